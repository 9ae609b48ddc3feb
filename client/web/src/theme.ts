// Light or dark: as the system says, until one chooses. Kept in this browser, not in the address.
import { onClick } from './dom';

const kKey = 'intervale-theme';

export function watchTheme(changed: () => void): void {
  const root = document.documentElement;
  const system = window.matchMedia('(prefers-color-scheme: dark)');
  const isDark = () => (root.dataset['theme'] ? root.dataset['theme'] === 'dark' : system.matches);
  const set = (theme: string) => {
    root.dataset['theme'] = theme;
    changed();
  };
  const kept = stored();
  if (kept === 'dark' || kept === 'light') set(kept);
  else changed();
  system.addEventListener('change', changed);
  onClick('theme', () => {
    const theme = isDark() ? 'light' : 'dark';
    set(theme);
    try {
      localStorage.setItem(kKey, theme);
    } catch {
      // Storage may be forbidden: then it holds until the page is left.
    }
  });
}

function stored(): string | null {
  try {
    return localStorage.getItem(kKey);
  } catch {
    return null;
  }
}
