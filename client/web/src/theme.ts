// Light or dark theme: the system's until the user chooses one. Stored in this browser, not in the address.
import { onClick } from './dom';

const kKey = 'intervale-theme';

export function watchTheme(onChange: () => void): void {
  const root = document.documentElement;
  const system = window.matchMedia('(prefers-color-scheme: dark)');
  const isDark = () => (root.dataset['theme'] ? root.dataset['theme'] === 'dark' : system.matches);
  const set = (theme: string) => {
    root.dataset['theme'] = theme;
    onChange();
  };
  const theme = stored();
  if (theme === 'dark' || theme === 'light') set(theme);
  else onChange();
  system.addEventListener('change', onChange);
  onClick('theme', () => {
    const theme = isDark() ? 'light' : 'dark';
    set(theme);
    try {
      localStorage.setItem(kKey, theme);
    } catch {
      // Storage may be disabled: then the choice lasts until the page is closed.
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
