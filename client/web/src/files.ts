// Files that the user opens or drops onto the page, or at addresses: data sets that are shown without a server.
import { LocalDataset, type LocalOptions } from '../package/src/local_dataset';
import type { Dataset } from '../package/src/datasets';
import { element, input, onClick } from './dom';

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
  // another file takes its place. options: told and failed.
  async open(file: FileOrAddress, taken: string[], options: LocalOptions): Promise<Dataset> {
    const local = await LocalDataset.open(file, nameOf(file), options);
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

// A file that the user has, or the address of one.
export type FileOrAddress = File | URL;
export const nameOf = (file: FileOrAddress): string =>
  file instanceof URL ? decodeURIComponent(file.pathname.slice(file.pathname.lastIndexOf('/') + 1)) : file.name;

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
