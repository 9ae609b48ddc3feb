// Files that the user opens or drops onto the page: data sets that are shown without a server.
import { LocalDataset } from '../package/src/local_dataset';
import type { Dataset } from '../package/src/datasets';
import { element, input, onClick } from './dom';

const kMostBytes = 2 ** 30; // the browser holds the file, and the core what it decodes to

const tooLarge = (name: string) => new Error(`${name} is too large to be shown by the page itself: serve it with intervale serve.`);

export class Files {
  private opened = new Map<Dataset, LocalDataset>();

  get datasets(): Dataset[] {
    return [...this.opened.keys()];
  }

  // What a data set was opened from; undefined: no file.
  of(dataset: Dataset): LocalDataset | undefined {
    return this.opened.get(dataset);
  }

  // Rejects, with a text for the user. taken: names of other data sets, which it does not get. A file of the same name as
  // another file takes its place.
  async open(file: File, taken: string[]): Promise<Dataset> {
    if (file.size > kMostBytes) throw tooLarge(file.name);
    const local = await LocalDataset.open(file, file.name);
    const { name } = local.dataset;
    const dataset = { ...local.dataset, name: taken.includes(name) ? `${name} (file)` : name };
    for (const [other, old] of this.opened) {
      if (other.name !== dataset.name) continue;
      this.opened.delete(other);
      old.close();
    }
    this.opened.set(dataset, local);
    return dataset;
  }
}

// The file at an address, relative to the page's. Rejects, with a text for the user. told: called with the bytes received.
export async function download(address: string, told: (bytes: number) => void): Promise<File> {
  const url = new URL(address, document.baseURI);
  const name = decodeURIComponent(url.pathname.slice(url.pathname.lastIndexOf('/') + 1));
  const response = await fetch(url).catch(() => null);
  if (!response) throw new Error(`${url.href} cannot be reached, or this page may not read it: its server (Access-Control-Allow-Origin) or the page's (--connect-origin) does not allow that.`);
  if (!response.ok || !response.body) throw new Error(`${url.href} was not received: the server responded with status ${response.status}.`);
  const chunks: Uint8Array<ArrayBuffer>[] = [];
  let bytes = 0;
  const reader = response.body.getReader();
  for (let part = await reader.read(); !part.done; part = await reader.read()) {
    chunks.push(part.value);
    bytes += part.value.length;
    if (bytes > kMostBytes) {
      await reader.cancel();
      throw tooLarge(name);
    }
    told(bytes);
  }
  return new File(chunks, name);
}

const hasFiles = (event: DragEvent): boolean => event.dataTransfer?.types.includes('Files') ?? false;

// open: called with a file that the user has chosen or dropped.
export function watchFiles(open: (file: File) => void): void {
  const chooser = input('file');
  onClick('open-file', () => chooser.click());
  chooser.addEventListener('change', () => {
    const file = chooser.files?.[0];
    chooser.value = ''; // the same file may be chosen again
    if (file) open(file);
  });
  let depth = 0; // of the elements that the file was dragged into
  const show = (to: number) => (element('drop').hidden = (depth = to) <= 0);
  document.addEventListener('dragenter', (event) => {
    if (hasFiles(event)) show(depth + 1);
  });
  document.addEventListener('dragleave', (event) => {
    if (hasFiles(event)) show(depth - 1);
  });
  document.addEventListener('dragover', (event) => {
    if (hasFiles(event)) event.preventDefault(); // or the browser would show the file in place of the page
  });
  document.addEventListener('drop', (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    show(0);
    const file = event.dataTransfer?.files[0];
    if (file) open(file);
  });
}
