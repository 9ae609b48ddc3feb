// The page's end of the worker: asks for what the view needs, no more often than is of use, and keeps `live` true.
import { streamUrl } from './datasets';
import type { Live } from './live';
import { sameJson } from './format';
import type { Box, Cap, Plane, Report, Request, Skin, Tets, View } from './messages';
import type { Store } from './store';

const kViewMs = 100; // between two views while something moves
const kBytesPerUpdate = 30; // on either side of the wire; see View.maxUpdates

export const updatesIn = (megabytes: number | null): number | null => (megabytes === null ? null : Math.round((megabytes * 1e6) / kBytesPerUpdate));

export interface Receiver {
  skin(skin: Skin): void;
  cap(cap: Cap): void;
  tets(tets: Tets): void;
  saved(format: string, name: string, bytes: ArrayBuffer): void;
  other(report: Report): void; // all reports, after the above
}

export class Session {
  private worker: Worker;
  private view: View | null = null;
  private sentView: View | null = null;
  private viewDue = 0; // when the next may be sent
  private viewTimer = 0;
  private plane: Plane | null = null;
  private sentPlane: Plane | null = null;
  private capAwaited = false;
  private tetsBox: Box | null = null;
  private tetsTimer = 0;
  private edges = false;

  constructor(private live: Store<Live>, private receiver: Receiver) {
    this.worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'intervale' });
    this.worker.onmessage = ({ data }: MessageEvent<Report>) => this.received(data);
    this.worker.onerror = (event) => this.fail(`The worker failed: ${event.message || 'it could not be loaded'}.`);
    this.worker.onmessageerror = () => this.fail('The worker sent what cannot be read.');
  }

  end(): void {
    this.worker.terminate();
  }

  send(request: Request): void {
    this.worker.postMessage(request);
  }

  // wanted: what is asked for first.
  open(dataset: string, wanted: { view: View; plane: Plane | null; tetsBox: Box | null; edges: boolean }): void {
    const { token } = this.live.value;
    this.live.set({ trouble: null, progress: null, tets: null, connection: { state: 'connecting' } });
    this.view = wanted.view;
    this.sentView = null;
    this.sendView();
    this.send({ type: 'open', url: streamUrl(), dataset, ...(token === null ? {} : { token }) });
    this.plane = this.sentPlane = wanted.plane;
    this.capAwaited = false;
    this.send({ type: 'clip', plane: wanted.plane });
    this.tetsBox = wanted.tetsBox;
    this.send({ type: 'tets', box: wanted.tetsBox });
    this.edges = wanted.edges;
    this.send({ type: 'edges', wanted: wanted.edges });
  }

  // Sent at once where nothing was sent in the last tenth of a second, else when that is over: so the last one of a motion always is.
  setView(view: View): void {
    this.view = view;
    if (this.viewTimer !== 0 || sameJson(view, this.sentView)) return;
    const wait = this.viewDue - performance.now();
    if (wait <= 0) return this.sendView();
    this.viewTimer = window.setTimeout(() => this.sendView(), wait);
  }

  // One question at a time: the newest is asked when the last is answered.
  setPlane(plane: Plane | null): void {
    this.plane = plane;
    this.askForCap();
  }

  setTetsBox(box: Box | null): void {
    if (sameJson(box, this.tetsBox)) return;
    this.tetsBox = box;
    if (this.tetsTimer === 0) {
      this.tetsTimer = window.setTimeout(() => {
        this.tetsTimer = 0;
        this.send({ type: 'tets', box: this.tetsBox });
      }, kViewMs);
    }
  }

  setEdges(wanted: boolean): void {
    if (wanted === this.edges) return;
    this.edges = wanted;
    this.send({ type: 'edges', wanted });
  }

  private sendView(): void {
    window.clearTimeout(this.viewTimer);
    this.viewTimer = 0;
    if (!this.view || sameJson(this.view, this.sentView)) return;
    this.sentView = this.view;
    this.viewDue = performance.now() + kViewMs;
    this.send({ type: 'view', view: this.view });
  }

  private askForCap(): void {
    if (this.capAwaited || sameJson(this.plane, this.sentPlane)) return;
    this.sentPlane = this.plane;
    this.capAwaited = true;
    this.send({ type: 'clip', plane: this.plane });
  }

  private received(report: Report): void {
    switch (report.type) {
      case 'connection':
        this.live.set({ connection: report.state, ...(report.state.state === 'open' ? { trouble: null } : {}) });
        break;
      case 'opened':
        this.live.set({ opened: { times: this.live.value.opened.times + 1, resumed: report.resumed } });
        break;
      case 'progress':
        this.live.set({ progress: report.progress });
        break;
      case 'skin':
        this.receiver.skin(report.skin);
        break;
      case 'cap':
        this.capAwaited = false;
        this.receiver.cap(report.cap);
        this.askForCap();
        break;
      case 'tets':
        this.live.set({ tets: report.tets.box ? { count: report.tets.count, outOf: report.tets.outOf } : null });
        this.receiver.tets(report.tets);
        break;
      case 'saved':
        this.live.set({ saving: null });
        this.receiver.saved(report.format, report.name, report.bytes);
        break;
      case 'error':
        this.fail(report.text);
        break;
    }
    this.receiver.other(report);
  }

  private fail(text: string): void {
    this.live.set({ trouble: text, saving: null, connection: { state: 'closed' } });
    this.capAwaited = false;
  }
}
