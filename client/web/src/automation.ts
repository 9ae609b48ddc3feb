// window.intervale: the page's interface for tests and for embedding pages. Values are read-only (except longestBlock)
// and current when they are read; changes are made through the functions.
import type { Report, Request } from '../package/src/messages';
import { exclusive, type ViewState } from './state';
import type { Status } from './status';
import type { Store } from './store';
import type { Viewer } from './viewer';
import type { LiveMesh } from '../package/src/live_mesh';

declare global {
  interface Window {
    intervale: ReturnType<typeof automation>;
  }
}

export const automation = (view: Store<ViewState>, status: Store<Status>, viewer: Viewer, mesh: LiveMesh) => ({
  get state() { return view.value; }, // the view, as in the address
  get live() { return status.value; }, // connection, data sets, errors
  get progress() { return status.value.progress; },
  stats: viewer.stats, // longestBlock may be set to 0, which restarts its measurement
  get isIdle() { return viewer.isIdle; }, // all that has arrived is drawn
  canvas: viewer.picture.canvas,
  set: (change: Partial<ViewState>) => view.set(exclusive(change)), // as the controls do
  send: (request: Request) => mesh.send(request), // to the worker
  next: <T extends Report['type']>(type: T) => mesh.next(type), // from the worker
  photograph: () => viewer.photograph(), // the canvas as PNG, without outlines
});
