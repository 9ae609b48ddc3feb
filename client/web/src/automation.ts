// window.intervale: the page's interface for tests and for embedding pages. Values are read-only (except longestBlock)
// and current when they are read; changes are made through the functions.
import type { Progress, Report, Request } from './messages';
import type { ViewState } from './state';
import type { Status } from './status';
import type { Store } from './store';
import type { Stats, Viewer } from './viewer';

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

export class Automation {
  private awaited: { type: string; resolve: (report: never) => void }[] = [];

  expose(view: Store<ViewState>, status: Store<Status>, viewer: Viewer, send: (request: Request) => void): void {
    window.intervale = {
      get state() {
        return view.value;
      },
      get live() {
        return status.value;
      },
      get progress() {
        return status.value.progress;
      },
      stats: viewer.stats,
      canvas: viewer.picture.canvas,
      set: (change) => view.set(change),
      send,
      next: (type) => new Promise((resolve) => this.awaited.push({ type, resolve })),
      photograph: () => viewer.photograph(),
    };
  }

  // Resolves the promises of next() that wait for this report.
  received(report: Report): void {
    const resolved = this.awaited.filter(({ type }) => type === report.type);
    if (resolved.length === 0) return;
    this.awaited = this.awaited.filter(({ type }) => type !== report.type);
    for (const { resolve } of resolved) resolve(report as never);
  }
}
