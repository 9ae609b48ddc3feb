// window.intervale: the page's interface for tests and for pages that embed it. What is read is true at that moment; nothing may be changed but by
// the functions.
import type { Live } from './live';
import type { Progress, Report, Request } from './messages';
import type { ViewState } from './state';
import type { Store } from './store';
import type { Stats, Viewer } from './viewer';

export interface Intervale {
  readonly state: Readonly<ViewState>; // the view, as in the address; pose null: the whole data set
  readonly live: Readonly<Live>; // connection, data sets, what failed
  readonly progress: Progress | null;
  readonly stats: Stats; // longestBlock may be set to 0, to measure from then on
  readonly canvas: HTMLCanvasElement;
  set(change: Partial<ViewState>): void; // as if chosen by hand
  send(request: Request): void; // to the worker
  next<T extends Report['type']>(type: T): Promise<Extract<Report, { type: T }>>; // the worker's next report of this type
  photograph(): Promise<Blob | null>; // PNG of the canvas, without handles and guides
}

declare global {
  interface Window {
    intervale: Intervale;
  }
}

export class Automation {
  private awaited: { type: string; resolve: (report: never) => void }[] = [];

  expose(view: Store<ViewState>, live: Store<Live>, viewer: Viewer, send: (request: Request) => void): void {
    window.intervale = {
      get state() {
        return view.value;
      },
      get live() {
        return live.value;
      },
      get progress() {
        return live.value.progress;
      },
      stats: viewer.stats,
      canvas: viewer.picture.canvas,
      set: (change) => view.set(change),
      send,
      next: (type) => new Promise((resolve) => this.awaited.push({ type, resolve })),
      photograph: () => viewer.photograph(),
    };
  }

  reported(report: Report): void {
    const met = this.awaited.filter(({ type }) => type === report.type);
    if (met.length === 0) return;
    this.awaited = this.awaited.filter(({ type }) => type !== report.type);
    for (const { resolve } of met) resolve(report as never);
  }
}
