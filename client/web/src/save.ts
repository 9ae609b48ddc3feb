// Things to take away: pictures, meshes, links.
import { element, onClick } from './dom';
import type { Live } from './live';
import type { Request } from './messages';
import type { Store } from './store';

const kTypes: Record<string, string> = { vtu: 'application/xml', stl: 'model/stl', glb: 'model/gltf-binary', png: 'image/png' };
const kFormats = ['vtu', 'stl', 'glb'] as const;

export function download(name: string, blob: Blob): void {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  window.setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

export const downloadMesh = (format: string, name: string, bytes: ArrayBuffer): void =>
  download(name, new Blob([bytes], { type: kTypes[format] ?? 'application/octet-stream' }));

// picture: draws without handles and guides, and gives what was drawn.
export function watchSaving(live: Store<Live>, send: (request: Request) => void, picture: () => Promise<Blob | null>): void {
  const note = element('share-note');
  const say = (text: string) => (note.textContent = text);
  onClick('copy-link', async () => {
    try {
      await navigator.clipboard.writeText(location.href);
      say('Copied: whoever opens it sees this view.');
    } catch {
      say(`The browser does not let this page copy. The link is the address: ${location.href}`);
    }
  });
  onClick('save-picture', async () => {
    const blob = await picture();
    if (!blob) return void say('The picture could not be made.');
    download(`${live.value.dataset?.name ?? 'intervale'}.png`, blob);
    say('Picture saved.');
  });
  for (const format of kFormats) {
    onClick(`save-${format}`, () => {
      live.set({ saving: format });
      send({ type: 'save', format });
      say(`Writing .${format}…`);
    });
  }
  let was: string | null = null;
  live.watch(['saving', 'skinVersion'], ({ saving, skinVersion }) => {
    if (was !== null && saving === null) say(live.value.trouble === null ? `.${was} saved.` : '');
    was = saving;
    for (const format of kFormats) element<HTMLButtonElement>(`save-${format}`).disabled = saving !== null || skinVersion === 0;
  });
}
