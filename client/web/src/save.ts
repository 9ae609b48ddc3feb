// Saves pictures and meshes as files, and copies links to the view.
import { element, onClick } from './dom';
import type { Request } from './messages';
import type { Status } from './status';
import type { Store } from './store';

const kMimeTypes: Record<string, string> = { vtu: 'application/xml', stl: 'model/stl', glb: 'model/gltf-binary', png: 'image/png' };
const kFormats = ['vtu', 'stl', 'glb'] as const;

export function download(name: string, blob: Blob): void {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  window.setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

export const downloadMesh = (format: string, name: string, bytes: ArrayBuffer): void =>
  download(name, new Blob([bytes], { type: kMimeTypes[format] ?? 'application/octet-stream' }));

// photograph: see Viewer.
export function watchSaving(status: Store<Status>, send: (request: Request) => void, photograph: () => Promise<Blob | null>): void {
  const note = element('share-note');
  const show = (text: string) => (note.textContent = text);
  onClick('copy-link', async () => {
    try {
      await navigator.clipboard.writeText(location.href);
      show('Link copied. It opens this view.');
    } catch {
      show(`The browser does not allow this page to copy. The link is the page's address: ${location.href}`);
    }
  });
  onClick('save-picture', async () => {
    const blob = await photograph();
    if (!blob) return void show('The picture could not be encoded.');
    download(`${status.value.dataset?.name ?? 'intervale'}.png`, blob);
    show('Picture saved.');
  });
  for (const format of kFormats) {
    onClick(`save-${format}`, () => {
      status.set({ saving: format });
      send({ type: 'save', format });
      show(`Writing .${format}…`);
    });
  }
  let last: string | null = null;
  status.watch(['saving', 'surfaceVersion'], ({ saving, surfaceVersion }) => {
    if (last !== null && saving === null) show(status.value.error === null ? `.${last} saved.` : '');
    last = saving;
    for (const format of kFormats) element<HTMLButtonElement>(`save-${format}`).disabled = saving !== null || surfaceVersion === 0;
  });
}
