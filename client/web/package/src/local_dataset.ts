// A data set in a file that the user has, or at an address, shown without a server of its own: a worker chooses what a view
// needs, as a server does. While it is read it takes 7 to 16 bytes of memory a sample.
import { type Dataset, datasetOf, type Statistics, statisticsOf } from './datasets.js';
import type { Told } from './file_source.js';
import type { LocalReply, LocalRequest } from './messages.js';

export interface LocalOptions {
  worker?: Worker; // one that runs local_worker.js, where a bundler or a content policy does not let it be found beside this file
  wasmUrl?: string | URL; // of local.wasm, where it is not beside local_worker.js
  told?: Told; // called as bytes of a file at an address arrive
  failed?: (error: Error) => void; // called if the rest of an opened file cannot be read: what was read can still be seen
}

// Of a file's name without folders: without its extension.
const stemOf = (name: string): string => name.replace(/\.[^.]*$/, '') || name || 'file';

export class LocalDataset {
  private constructor(readonly dataset: Dataset, readonly statistics: Statistics | null, private readonly worker: Worker) {}

  // Reads a file that intervale build made; resolves as soon as there is something to see of it. Rejects, with a text for
  // the user, if it cannot be read. file: or its address. name: the file's.
  static async open(file: Blob | URL, name: string, { worker: given, wasmUrl, told, failed }: LocalOptions = {}): Promise<LocalDataset> {
    const worker = given ?? new Worker(new URL('./local_worker.js', import.meta.url), { type: 'module', name: 'intervale-file' });
    const request: LocalRequest = {
      type: 'load',
      file: file instanceof URL ? file.href : file,
      name: stemOf(name),
      wasmUrl: wasmUrl === undefined ? null : new URL(wasmUrl, document.baseURI).href,
    };
    let isOpen = false;
    try {
      const description = await new Promise<string>((resolve, reject) => {
        worker.onmessage = ({ data }: MessageEvent<LocalReply>) => {
          if (data.type === 'received') return told?.(data.received, data.size);
          if (data.type === 'loaded') {
            isOpen = true;
            return resolve(data.description);
          }
          const error = new Error(`${name}: ${data.text}`);
          if (isOpen) failed?.(error);
          else reject(error);
        };
        worker.onerror = (event) => reject(new Error(`${name} cannot be read: ${event.message || 'the worker could not be loaded'}`));
        worker.postMessage(request);
      });
      const json: unknown = JSON.parse(description);
      const dataset = datasetOf(json);
      if (!dataset) throw new Error(`${name}: its description cannot be read`);
      return new LocalDataset(dataset, statisticsOf(json, dataset), worker);
    } catch (error) {
      worker.terminate();
      throw error;
    }
  }

  // A connection, for LiveMesh.open(): for one session.
  connect(): MessagePort {
    const { port1, port2 } = new MessageChannel();
    const request: LocalRequest = { type: 'connect', port: port2 };
    this.worker.postMessage(request, [port2]);
    return port1;
  }

  // Frees it. Sessions get nothing more.
  close(): void {
    this.worker.terminate();
  }
}
