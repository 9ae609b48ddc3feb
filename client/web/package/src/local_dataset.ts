// A data set in a file that the user has, shown without a server: a worker of its own chooses what a view needs, as a
// server does. The file must fit in memory, several times.
import { type Dataset, datasetOf, type Statistics, statisticsOf } from './datasets.js';
import type { LocalReply, LocalRequest } from './messages.js';

export interface LocalOptions {
  worker?: Worker; // one that runs local_worker.js, where a bundler or a content policy does not let it be found beside this file
  wasmUrl?: string | URL; // of local.wasm, where it is not beside local_worker.js
}

// Of a file's name without folders: without its extension.
const stemOf = (name: string): string => name.replace(/\.[^.]*$/, '') || name || 'file';

export class LocalDataset {
  private constructor(readonly dataset: Dataset, readonly statistics: Statistics | null, private readonly worker: Worker) {}

  // Reads a file that intervale build made. Rejects, with a text for the user, if it cannot be read. name: the file's.
  static async open(file: Blob, name: string, { worker: given, wasmUrl }: LocalOptions = {}): Promise<LocalDataset> {
    const worker = given ?? new Worker(new URL('./local_worker.js', import.meta.url), { type: 'module', name: 'intervale-file' });
    const request: LocalRequest = { type: 'load', file, name: stemOf(name), wasmUrl: wasmUrl === undefined ? null : new URL(wasmUrl, document.baseURI).href };
    try {
      const description = await new Promise<string>((resolve, reject) => {
        worker.onmessage = ({ data }: MessageEvent<LocalReply>) => {
          if (data.type === 'loaded') resolve(data.description);
          else reject(new Error(`${name}: ${data.text}`));
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
