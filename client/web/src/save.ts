// Saves pictures and meshes as files, and copies links to the view.
import { create, element, onClick } from './dom';
import type { MeshFormat, Report } from '../package/src/messages';
import type { Status } from './status';
import type { Store } from './store';
import type { Viewer } from './viewer';
import type { LiveMesh } from '../package/src/live_mesh';

const kMimeTypes: Record<MeshFormat, string> = { vtu: 'application/xml', stl: 'model/stl', glb: 'model/gltf-binary' };
const kFormats = Object.keys(kMimeTypes) as MeshFormat[];

function download(name: string, blob: Blob): void {
  const url = URL.createObjectURL(blob);
  create('a', { href: url, download: name }).click();
  window.setTimeout(() => URL.revokeObjectURL(url), 60_000);
}

export const downloadMesh = ({ format, name, bytes }: Extract<Report, { type: 'saved' }>): void =>
  download(name, new Blob([bytes], { type: kMimeTypes[format] }));

export function watchSaving(status: Store<Status>, viewer: Viewer, mesh: LiveMesh): void {
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
    const blob = await viewer.photograph();
    if (!blob) return void show('The picture could not be encoded.');
    download(`${status.value.dataset?.name ?? 'intervale'}.png`, blob);
    show('Picture saved.');
  });
  for (const format of kFormats) {
    onClick(`save-${format}`, () => {
      status.set({ saving: format });
      mesh.send({ type: 'save', format });
      show(`Writing .${format}…`);
    });
  }
  let last: MeshFormat | null = null;
  status.watch(['saving', 'surfaceVersion'], ({ saving, surfaceVersion }) => {
    if (last !== null && saving === null) show(status.value.error === null ? `.${last} saved.` : '');
    last = saving;
    for (const format of kFormats) element<HTMLButtonElement>(`save-${format}`).disabled = saving !== null || surfaceVersion === 0;
  });
}
