// The page's side of the worker: sends what the view needs at a limited rate, and keeps the status current.
import { streamUrl } from './datasets';
import type { Box, Plane, Report, Request, View } from './messages';
import { paletteOf } from './palette';
import type { Range } from './range';
import type { Status } from './status';
import type { Store } from './store';

const kIntervalMs = 100; // least time between two views, or two boxes of tetrahedra
const kBytesPerUpdate = 30; // see View.maxUpdates

// null: no limit.
export const updatesIn = (megabytes: number | null): number | null =>
  megabytes === null ? null : Math.round((megabytes * 1e6) / kBytesPerUpdate);

const sameJson = (a: unknown, b: unknown): boolean => JSON.stringify(a) === JSON.stringify(b);

// What the view needs from the worker.
export interface Wanted {
  view: View;
  plane: Plane | null;
  tetsBox: Box | null;
  edges: boolean;
  values: boolean; // of the field, for colours, the probe and the volume
  volume: boolean; // all tetrahedra
}

export class WorkerClient {
  private worker: Worker;
  private wanted: Wanted | null = null;
  private sentView: View | null = null;
  private nextViewAt = 0; // performance.now()
  private viewTimer = 0;
  private sentPlane: Plane | null = null;
  private isAwaitingCap = false;
  private wantedPreview: Range[] | null = null;
  private previewed: Range[] | null = null; // sent
  private isAwaitingPreview = false;
  private tetsTimer = 0;

  // received: called with each report, after the status has changed.
  constructor(private status: Store<Status>, private received: (report: Report) => void) {
    this.worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'intervale' });
    this.worker.onmessage = ({ data }: MessageEvent<Report>) => this.receive(data);
    this.worker.onerror = (event) => this.fail(`The worker failed: ${event.message || 'it could not be loaded'}.`);
    this.worker.onmessageerror = () => this.fail('A message from the worker could not be read.');
  }

  terminate(): void {
    this.worker.terminate();
  }

  send(request: Request): void {
    this.worker.postMessage(request);
  }

  // The next report of this type.
  next<T extends Report['type']>(type: T): Promise<Extract<Report, { type: T }>> {
    return new Promise((resolve) => {
      const listen = ({ data }: MessageEvent) => {
        if (data.type !== type) return;
        this.worker.removeEventListener('message', listen);
        resolve(data);
      };
      this.worker.addEventListener('message', listen);
    });
  }

  // wanted: what the session starts with.
  open(dataset: string, wanted: Wanted): void {
    const { token } = this.status.value;
    this.status.set({ error: null, progress: null, tets: null, connection: { state: 'connecting' } });
    this.wanted = wanted;
    this.sentView = null;
    this.sendView();
    this.send({ type: 'open', url: streamUrl(), dataset, ...(token === null ? {} : { token }) });
    this.sentPlane = wanted.plane;
    this.isAwaitingCap = this.isAwaitingPreview = false;
    this.send({ type: 'clip', plane: wanted.plane });
    this.send({ type: 'tets', box: wanted.tetsBox });
    this.send({ type: 'edges', wanted: wanted.edges });
    this.send({ type: 'values', wanted: wanted.values });
    this.send({ type: 'volume', wanted: wanted.volume });
  }

  // Sends what differs from what was wanted before.
  update(wanted: Wanted): void {
    const last = this.wanted;
    this.wanted = wanted;
    this.requestView();
    this.requestCap();
    if (!sameJson(wanted.tetsBox, last?.tetsBox ?? null)) this.requestTets();
    if (wanted.edges !== (last?.edges ?? false)) this.send({ type: 'edges', wanted: wanted.edges });
    if (wanted.values !== (last?.values ?? false)) this.send({ type: 'values', wanted: wanted.values });
    if (wanted.volume !== (last?.volume ?? false)) this.send({ type: 'volume', wanted: wanted.volume });
  }

  // Shows ranges of what was received, until the next view. One request at a time: the latest ranges are sent when the
  // last ones were answered.
  preview(ranges: Range[]): void {
    this.wantedPreview = ranges;
    if (this.isAwaitingPreview || sameJson(ranges, this.previewed)) return;
    this.previewed = ranges;
    this.isAwaitingPreview = true;
    this.send({ type: 'preview', ranges });
  }

  // Sends at once, or when the interval since the last one is over: the last view of a motion is always sent.
  private requestView(): void {
    if (this.viewTimer !== 0 || sameJson(this.wanted?.view, this.sentView)) return;
    const wait = this.nextViewAt - performance.now();
    if (wait <= 0) return this.sendView();
    this.viewTimer = window.setTimeout(() => this.sendView(), wait);
  }

  private sendView(): void {
    window.clearTimeout(this.viewTimer);
    this.viewTimer = 0;
    if (!this.wanted || sameJson(this.wanted.view, this.sentView)) return;
    this.sentView = this.wanted.view;
    this.nextViewAt = performance.now() + kIntervalMs;
    this.wantedPreview = this.previewed = null; // the view is shown from now on
    this.send({ type: 'view', view: this.sentView });
  }

  private requestTets(): void {
    if (this.tetsTimer !== 0) return;
    this.tetsTimer = window.setTimeout(() => {
      this.tetsTimer = 0;
      this.send({ type: 'tets', box: this.wanted!.tetsBox });
    }, kIntervalMs);
  }

  // One request at a time: the latest plane is sent when the last one was answered.
  private requestCap(): void {
    const plane = this.wanted?.plane ?? null;
    if (this.isAwaitingCap || sameJson(plane, this.sentPlane)) return;
    this.sentPlane = plane;
    this.isAwaitingCap = true;
    this.send({ type: 'clip', plane });
  }

  private receive(report: Report): void {
    switch (report.type) {
      case 'connection':
        this.status.set({ connection: report.state, ...(report.state.state === 'open' ? { error: null } : {}) });
        break;
      case 'opened':
        this.status.set({ opened: { times: this.status.value.opened.times + 1, resumed: report.resumed } });
        break;
      case 'palettes':
        this.status.set({ palettes: report.palettes.map(paletteOf) });
        break;
      case 'progress':
        this.status.set({ progress: report.progress });
        break;
      case 'cap':
        this.isAwaitingCap = false;
        this.requestCap();
        break;
      case 'preview':
        this.isAwaitingPreview = false;
        if (this.wantedPreview) this.preview(this.wantedPreview);
        break;
      case 'tets':
        this.status.set({ tets: report.tets.box ? { count: report.tets.count, outOf: report.tets.outOf } : null });
        break;
      case 'saved':
        this.status.set({ saving: null });
        break;
      case 'error':
        this.fail(report.text);
        break;
    }
    this.received(report);
  }

  private fail(text: string): void {
    this.status.set({ error: text, saving: null, connection: { state: 'closed' } });
    this.isAwaitingCap = this.isAwaitingPreview = false;
  }
}
