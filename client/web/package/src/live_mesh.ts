// A mesh that refines while it is received: the main thread's side of the worker. Sends what is wanted at a limited
// rate, and tells what has arrived as events.
import { type Dataset, listDatasets } from './datasets.js';
import { fitted } from './camera.js';
import { frameOf } from './frame.js';
import type { Box, MeshFormat, Plane, Report, Request, Vec3, View } from './messages.js';
import { type Range, rangeOf } from './ranges.js';

const kIntervalMs = 100; // least time between two views, or two boxes of tetrahedra
const kBytesPerUpdate = 30; // see View.maxUpdates
const kViewport: [number, number] = [1280, 800]; // of a view that nothing else is known of

// For View.maxUpdates; null: no limit.
export const updatesIn = (megabytes: number | null): number | null =>
  megabytes === null ? null : Math.round((megabytes * 1e6) / kBytesPerUpdate);

const sameJson = (a: unknown, b: unknown): boolean => JSON.stringify(a) === JSON.stringify(b);

// What is wanted from the server and of its mesh.
export interface Wanted {
  view: View;
  plane: Plane | null; // of a Cap
  tetsBox: Box | null; // of Tets
  edges: boolean; // of pieces
  values: boolean; // of the field or a channel, at vertices
  volume: boolean; // all tetrahedra; needs values
  standIn: number | null; // triangles of a coarser surface to draw while the camera moves; null: none
}

// A view of all of a data set, within one pixel in a picture of this size (pixels). change: what is to differ.
export function viewOf(dataset: Dataset, viewport: [number, number] = kViewport, change: Partial<View> = {}): View {
  const range = rangeOf(dataset, null);
  return {
    camera: { ...fitted(frameOf(dataset).box, viewport[0] / viewport[1]), viewport },
    ranges: range ? [range] : [],
    uniform: false,
    channel: null,
    probed: [],
    pixelError: 1,
    region: null,
    opaque: false,
    maxTets: null,
    maxUpdates: null,
    ...change,
  };
}

// Just the surfaces of a view.
export const surfacesOf = (view: View): Wanted => ({ view, plane: null, tetsBox: null, edges: false, values: false, volume: false, standIn: null });

export interface LiveMeshOptions {
  worker?: Worker; // one that runs worker.js, where a bundler or a content policy does not let it be found beside this file
  wasmUrl?: string | URL; // of core.wasm, where it is not beside worker.js
  isShownLater?: boolean; // the next surface waits for shown(); else it may follow at once
}

// The type of an event is that of the report that it brings as its detail, but for 'load-error', which brings an error's.
// 'load-start' and 'load-end' enclose the time in which the mesh is not yet what is wanted.
export type LiveMeshEvents = { [Type in Report['type'] as Type extends 'error' ? 'load-error' : Type]: CustomEvent<Extract<Report, { type: Type }>> } & {
  'load-start': Event;
  'load-end': Event;
};

interface Target {
  addEventListener<T extends keyof LiveMeshEvents>(type: T, listener: (event: LiveMeshEvents[T]) => void, options?: boolean | AddEventListenerOptions): void;
  removeEventListener<T extends keyof LiveMeshEvents>(type: T, listener: (event: LiveMeshEvents[T]) => void, options?: boolean | EventListenerOptions): void;
  dispatchEvent(event: Event): boolean;
}

export class LiveMesh extends (EventTarget as new () => Target) {
  private readonly worker: Worker;
  private readonly isShownLater: boolean;
  private wanted: Wanted | null = null; // since open()
  private sentView: View | null = null;
  private views = 0; // sent
  private isLoading = false; // between load-start and load-end
  private nextViewAt = 0; // performance.now()
  private viewTimer = 0;
  private sentPlane: Plane | null = null;
  private isAwaitingCap = false;
  private wantedPreview: Range[] | null = null;
  private previewed: Range[] | null = null; // sent
  private isAwaitingPreview = false;
  private tetsTimer = 0;

  // Starts the worker, which loads the client core.
  constructor({ worker, wasmUrl, isShownLater = false }: LiveMeshOptions = {}) {
    super();
    this.isShownLater = isShownLater;
    this.worker = worker ?? new Worker(new URL('./worker.js', import.meta.url), { type: 'module', name: 'intervale' });
    this.worker.onmessage = ({ data }: MessageEvent<Report>) => this.receive(data);
    this.worker.onerror = (event) => this.fail(`The worker failed: ${event.message || 'it could not be loaded'}.`);
    this.worker.onmessageerror = () => this.fail('A message from the worker could not be read.');
    this.send({ type: 'load', wasmUrl: wasmUrl === undefined ? null : new URL(wasmUrl, document.baseURI).href });
  }

  // Ends the session and the worker: there are no events after this.
  close(): void {
    window.clearTimeout(this.viewTimer);
    window.clearTimeout(this.tetsTimer);
    this.worker.terminate();
  }

  // Connects to the data set of this name; a session before it ends. to: the address of the WebSocket (streamUrl()), or the
  // connection to a file (LocalDataset.connect()).
  open(to: string | MessagePort, dataset: string, wanted: Wanted, token: string | null = null): void {
    this.wanted = wanted;
    this.sentView = null;
    this.send({ type: 'open', to, dataset, ...(token === null ? {} : { token }) }, typeof to === 'string' ? [] : [to]);
    this.sendView(); // to this session, not to the last one, whose data set may lack these ranges
    this.sentPlane = wanted.plane;
    this.isAwaitingCap = this.isAwaitingPreview = false;
    this.send({ type: 'clip', plane: wanted.plane });
    this.send({ type: 'tets', box: wanted.tetsBox });
    this.send({ type: 'edges', wanted: wanted.edges });
    this.send({ type: 'values', wanted: wanted.values });
    this.send({ type: 'volume', wanted: wanted.volume });
    this.send({ type: 'standIn', triangles: wanted.standIn });
  }

  // What is wanted from now on, where it changes. Nothing before open().
  update(change: Partial<Wanted>): void {
    const last = this.wanted;
    if (!last) return;
    const wanted = (this.wanted = { ...last, ...change });
    this.requestView();
    this.requestCap();
    if (!sameJson(wanted.tetsBox, last.tetsBox)) this.requestTets();
    if (wanted.edges !== last.edges) this.send({ type: 'edges', wanted: wanted.edges });
    if (wanted.values !== last.values) this.send({ type: 'values', wanted: wanted.values });
    if (wanted.volume !== last.volume) this.send({ type: 'volume', wanted: wanted.volume });
    if (wanted.standIn !== last.standIn) this.send({ type: 'standIn', triangles: wanted.standIn });
  }

  // The same for parts of the view.
  updateView(change: Partial<View>): void {
    if (this.wanted) this.update({ view: { ...this.wanted.view, ...change } });
  }

  // Shows ranges of what was received, until the next view: for a range that is being dragged. One request at a time:
  // the latest ranges are sent when the last ones were answered.
  preview(ranges: Range[]): void {
    this.wantedPreview = ranges;
    if (this.isAwaitingPreview || sameJson(ranges, this.previewed)) return;
    this.previewed = ranges;
    this.isAwaitingPreview = true;
    this.send({ type: 'preview', ranges });
  }

  // With isShownLater: this version of the surface is on the screen, so that the next may come.
  shown(version: number): void {
    this.send({ type: 'shown', version });
  }

  // The mesh as a file. Rejects if there is none yet.
  async save(format: MeshFormat): Promise<ArrayBuffer> {
    this.send({ type: 'save', format });
    return (await this.answer('saved')).bytes;
  }

  // At a point of the world: of the field, then of the data set's channels in their order, of a vector the length; NaN where
  // the view does not bring them along (View.probed). null outside of the data set's box, or before there is a mesh.
  async valuesAt(at: Vec3): Promise<number[] | null> {
    this.send({ type: 'probe', at });
    for (;;) {
      const { at: answered, values } = await this.answer('probed');
      if (sameJson(answered, at)) return values;
    }
  }

  // Of the mesh: equal for equal meshes, whichever program made them.
  async digest(): Promise<string> {
    this.send({ type: 'digest' });
    return (await this.answer('digest')).digest;
  }

  // To the worker: for what has no function here.
  send(request: Request, transfer: Transferable[] = []): void {
    this.worker.postMessage(request, transfer);
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

  private answer<T extends Report['type']>(type: T): Promise<Extract<Report, { type: T }>> {
    return new Promise((resolve, reject) => {
      const listen = ({ data }: MessageEvent) => {
        if (data.type !== type && data.type !== 'error') return;
        this.worker.removeEventListener('message', listen);
        if (data.type === 'error') reject(new Error(data.text));
        else resolve(data);
      };
      this.worker.addEventListener('message', listen);
    });
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
    this.send({ type: 'view', view: this.sentView, number: ++this.views });
    if (this.isLoading) return;
    this.isLoading = true;
    this.dispatchEvent(new Event('load-start'));
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
      case 'cap':
        this.isAwaitingCap = false;
        this.requestCap();
        break;
      case 'preview':
        this.isAwaitingPreview = false;
        if (this.wantedPreview) this.preview(this.wantedPreview);
        break;
      case 'error':
        return this.fail(report.text);
    }
    this.dispatchEvent(new CustomEvent(report.type, { detail: report }));
    if (report.type === 'surface' && !this.isShownLater) this.shown(report.change.version);
    if (report.type !== 'progress' || !report.progress.done || report.progress.view !== this.views || !this.isLoading) return;
    this.isLoading = false;
    this.dispatchEvent(new Event('load-end'));
  }

  private fail(text: string): void {
    this.isAwaitingCap = this.isAwaitingPreview = this.isLoading = false;
    this.dispatchEvent(new CustomEvent('load-error', { detail: { type: 'error', text } }));
  }
}

// A server's address and a data set's name of "wss://host:port/name" or "https://host:port/name"; the server may be
// below a path. Throws a TypeError if it is none.
export function addressOf(text: string): { base: URL; name: string } {
  const url = new URL(text);
  const found = /^(ws|wss|http|https):$/.exec(url.protocol);
  const last = url.pathname.slice(url.pathname.lastIndexOf('/') + 1);
  const name = decoded(last);
  if (!found || name === '') throw new TypeError(`${text} is not the address of a data set, as wss://host:port/name`);
  const base = new URL(`${found[1]!.replace('ws', 'http')}://${url.host}${url.pathname}`);
  return { base: new URL('.', base), name };
}

// Of an escaped part of a URL; empty if it is not UTF-8.
function decoded(text: string): string {
  try {
    return decodeURIComponent(text);
  } catch {
    return '';
  }
}

// What a server tells of one of its data sets. Rejects, with a text for the user, if there is none of this name.
export async function describe(address: string, token: string | null = null): Promise<Dataset> {
  const { base, name } = addressOf(address);
  const listing = await listDatasets(base, token);
  if ('needsToken' in listing) throw new Error(token === null ? 'The server requires a token.' : 'The server does not accept this token.');
  if ('error' in listing) throw new Error(listing.error);
  const found = listing.datasets.find((dataset) => dataset.name === name);
  if (!found) throw new Error(`The server has no data set “${name}”.`);
  return found;
}
