// window.intervale: the page's interface for tests and for embedding pages. Values are read-only (except longestBlock)
// and current when they are read; changes are made through the functions.
import type { Progress, Report, Request } from './messages';
import type { ViewState } from './state';
import type { Status } from './status';
import type { Store } from './store';
import type { Stats, Viewer } from './viewer';
import type { WorkerClient } from './worker_client';

export interface Intervale {
  readonly state: Readonly<ViewState>; // the view, as in the address
  readonly live: Readonly<Status>; // connection, data sets, errors
  readonly progress: Progress | null;
  readonly stats: Stats; // longestBlock may be set to 0, which restarts its measurement
  readonly canvas: HTMLCanvasElement;
  set(change: Partial<ViewState>): void; // as the controls do
  send(request: Request): void; // to the worker
  next<T extends Report['type']>(type: T): Promise<Extract<Report, { type: T }>>; // from the worker
  photograph(): Promise<Blob | null>; // the canvas as PNG, without outlines
}

declare global {
  interface Window {
    intervale: Intervale;
  }
}

export function expose(view: Store<ViewState>, status: Store<Status>, viewer: Viewer, worker: WorkerClient): void {
  window.intervale = {
    get state() { return view.value; },
    get live() { return status.value; },
    get progress() { return status.value.progress; },
    stats: viewer.stats,
    canvas: viewer.picture.canvas,
    set: (change) => view.set(change),
    send: (request) => worker.send(request),
    next: (type) => worker.next(type),
    photograph: () => viewer.photograph(),
  };
}
