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
const extras: Extras = { edges: false, values: false, plane: null, box: null, volume: false };

async function handle(request: Request): Promise<void> {
  const loaded = await core;
  switch (request.type) {
    case 'open':
      session?.close();
      session = new StreamSession(loaded, request, extras, report);
      if (view) session.look(view);
      return;
    case 'view':
      view = request.view;
      return session?.look(view);
    case 'preview':
      return session ? session.preview(request.ranges) : report({ type: 'preview' });
    case 'clip':
      extras.plane = request.plane;
      return session?.sendCap();
    case 'tets':
      extras.box = request.box;
      return session?.sendTets();
    case 'edges':
      if (extras.edges === request.wanted) return;
      extras.edges = request.wanted;
      return session?.remake();
    case 'values':
      if (extras.values === request.wanted) return;
      extras.values = request.wanted;
      return session?.remake();
    case 'volume':
      if (extras.volume === request.wanted) return;
      extras.volume = request.wanted;
      return session?.remake();
    case 'shown':
      return session?.pageShows(request.version);
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
core.then(
  (loaded) => report({ type: 'palettes', palettes: loaded.palettes() }),
  (error: unknown) => report({ type: 'error', text: `The client core cannot be loaded: ${String(error)}` }),
);
