// The worker: loads the client core and hands the page's requests to the open session.
import createCore, { type Core } from './core/core.js';

import type { Report, Request } from './messages.js';
import { type Extras, StreamSession } from './stream_session.js';

const scope = self as unknown as DedicatedWorkerGlobalScope;
const report = (message: Report, transfer: Transferable[] = []) => scope.postMessage(message, transfer);

let core: Promise<Core> | null = null; // since the first request
let session: StreamSession | null = null;
const extras: Extras = { edges: false, values: false, plane: null, box: null, volume: false, standIn: null };

function load(wasmUrl: string | null): Promise<Core> {
  const loading = createCore({ locateFile: () => wasmUrl ?? new URL('./core/core.wasm', import.meta.url).href });
  loading.then(
    (loaded) => report({ type: 'palettes', palettes: loaded.palettes() }),
    (error: unknown) => report({ type: 'error', text: `The client core cannot be loaded: ${String(error)}` }),
  );
  return loading;
}

async function handle(request: Request): Promise<void> {
  core ??= load(request.type === 'load' ? request.wasmUrl : null);
  const loaded = await core;
  switch (request.type) {
    case 'load':
      return;
    case 'open':
      session?.close();
      session = new StreamSession(loaded, request, extras, report);
      return;
    case 'view':
      return session?.look(request.view, request.number);
    case 'preview':
      return session ? session.preview(request.ranges) : report({ type: 'preview' });
    case 'clip':
      extras.plane = request.plane;
      return session?.sendCap();
    case 'tets':
      extras.box = request.box;
      return session?.sendTets();
    case 'edges':
    case 'values':
    case 'volume':
      if (extras[request.type] === request.wanted) return;
      extras[request.type] = request.wanted;
      return session?.remake();
    case 'standIn':
      extras.standIn = request.triangles;
      return session?.wantStandIn();
    case 'shown':
      return session?.pageShows(request.version);
    case 'probe':
      return session ? session.probe(request.at) : report({ type: 'probed', at: request.at, values: null });
    case 'save':
      return session?.save(request.format);
    case 'digest':
      return session?.digest();
  }
}

// One after another, also while the core is being loaded.
let last: Promise<void> = Promise.resolve();
scope.onmessage = ({ data }: MessageEvent<Request>) => {
  const failed = (error: unknown) => report({ type: 'error', text: `The client core failed: ${String(error)}` });
  last = last.then(() => handle(data)).catch(failed);
};
