// The worker: loads the client core and hands the page's requests to the open session.
import createCore from '@core/core.js';
import wasmUrl from '@core/core.wasm?url';

import type { Report, Request, View } from './messages';
import { type Extras, StreamSession } from './stream_session';

const scope = self as unknown as DedicatedWorkerGlobalScope;
const report = (message: Report, transfer: Transferable[] = []) => scope.postMessage(message, transfer);

const core = createCore({ locateFile: () => wasmUrl });
let session: StreamSession | null = null;
let view: View | null = null;
const extras: Extras = { edges: false, plane: null, box: null };

async function handle(request: Request): Promise<void> {
  const loaded = await core;
  switch (request.type) {
    case 'open':
      session?.close();
      session = new StreamSession(loaded, request, extras, report);
      if (view) session.look(view);
      break;
    case 'view':
      view = request.view;
      session?.look(view);
      break;
    case 'clip':
      extras.plane = request.plane;
      session?.sendCap();
      break;
    case 'tets':
      extras.box = request.box;
      session?.sendTets();
      break;
    case 'edges':
      if (extras.edges === request.wanted) break;
      extras.edges = request.wanted;
      session?.remake();
      break;
    case 'shown':
      session?.pageShows(request.version);
      break;
    case 'save':
      session?.save(request.format);
      break;
    case 'digest':
      session?.digest();
      break;
  }
}

// One after another, also while the core is being loaded.
let last: Promise<void> = Promise.resolve();
scope.onmessage = ({ data }: MessageEvent<Request>) => {
  const failed = (error: unknown) => report({ type: 'error', text: `The client core failed: ${String(error)}` });
  last = last.then(() => handle(data)).catch(failed);
};
core.catch((error: unknown) => report({ type: 'error', text: `The client core cannot be loaded: ${String(error)}` }));
