// The worker: the connection, and the core that holds the mesh. It tells the page what changed, and is never asked to wait by it.
//
// Work is done in turns: all messages that have come, then, when the page has shown the last skin and enough time has passed, the next one. A skin is
// made in at most about half of the time, so that a stream that comes fast is not held up by drawings of its middle.
import createCore from '@core/core.js';
import wasmUrl from '@core/core.wasm?url';

import type { Box, Plane, Report, Request, View } from './messages';

const kLeastSkinInterval = 40; // milliseconds
const kProgressInterval = 100;
const kFirstWait = 100;
const kLongestWait = 3000;
const kNormal = 1000;
const kGoingAway = 1001;
const kServerFailed = 1011;
const kTimedOut = 4408;

type Core = Awaited<ReturnType<typeof createCore>>;
type Viewer = InstanceType<Core['Viewer']>;

const scope = self as unknown as DedicatedWorkerGlobalScope;
const report = (message: Report, transfer: Transferable[] = []) => scope.postMessage(message, transfer);

class Session {
  private viewer: Viewer;
  private socket: WebSocket | null = null;
  private ended = false;
  private attempt = 0;
  private timer = 0;
  private turn = 0; // timer of the next turn
  private opened = false;
  private view: View | null = null;

  private version = 0; // of the last skin made
  private shown = 0; // ... that the page shows
  private changed = false; // since the last skin
  private all = true; // the next skin has everything
  private skinEnd = 0; // when the last one was made
  private skinTime = 0; // and how long that took
  private progressAt = 0;
  private progressTimer = 0;
  private busy = { updates: 0, seconds: 0 };

  edges = false;
  plane: Plane | null = null;
  box: Box | null = null;

  constructor(
    private readonly core: Core,
    private readonly url: string,
    private readonly dataset: string,
    private readonly token: string | undefined,
  ) {
    this.viewer = new core.Viewer(dataset);
  }

  look(view: View): void {
    this.view = view;
    const wrong = this.viewer.look(view);
    if (wrong) return this.fail(wrong);
    if (this.socket === null && !this.ended && this.timer === 0) this.connect();
    this.send();
    this.changed = true; // a budget hides or shows at once
    this.tellProgress(true);
    this.plan();
  }

  pageShows(version: number): void {
    this.shown = version;
    this.plan();
  }

  drawEverything(): void {
    this.all = true;
    this.changed = true;
    this.tellProgress(true);
    this.plan();
  }

  close(): void {
    this.ended = true;
    clearTimeout(this.timer);
    clearTimeout(this.turn);
    clearTimeout(this.progressTimer);
    this.socket?.close(kNormal);
    this.socket = null;
    this.viewer.delete();
  }

  save(format: 'vtu' | 'stl' | 'glb'): void {
    if (!this.opened) return report({ type: 'error', text: 'there is no mesh to save yet' });
    const bytes = this.viewer.save(`mesh.${format}`);
    if (typeof bytes === 'string') return report({ type: 'error', text: `the mesh cannot be saved: ${bytes}` });
    report({ type: 'saved', format, name: `${this.dataset}.${format}`, bytes }, [bytes]);
  }

  digest(): void {
    if (!this.opened) return;
    const { updates, tets } = this.viewer.progress();
    report({ type: 'digest', digest: this.viewer.digest(), updates, tets });
  }

  // At once where the mesh is as it was for the last skin, else with the next one. Answered even where there is nothing to cut yet.
  cut(): void {
    if (this.plane !== null && this.version > 0 && this.viewer.isStale()) return this.plan();
    if (this.version === 0 || this.plane === null) {
      return report({ type: 'cap', cap: { plane: this.plane, vertices: new ArrayBuffer(0), triangles: 0, version: this.version } });
    }
    const cap = this.viewer.cap(this.plane);
    report({ type: 'cap', cap: { ...cap, plane: this.plane, version: this.version } }, [cap.vertices]);
  }

  showTets(): void {
    if (this.box !== null && this.version > 0 && this.viewer.isStale()) return this.plan();
    if (this.version === 0 || this.box === null) {
      return report({ type: 'tets', tets: { box: this.box, vertices: new ArrayBuffer(0), indices: new ArrayBuffer(0), count: 0, outOf: 0 } });
    }
    const tets = this.viewer.tets(this.box);
    report({ type: 'tets', tets: { ...tets, box: this.box } }, [tets.vertices, tets.indices]);
  }

  private connect(): void {
    this.timer = 0;
    if (this.attempt === 0) report({ type: 'connection', state: { state: 'connecting' } });
    const protocols = ['intervale.v1'];
    if (this.token) protocols.push(`intervale.token.${base64url(this.token)}`);
    const socket = new WebSocket(this.url, protocols);
    socket.binaryType = 'arraybuffer';
    this.socket = socket;
    let greeted = false;
    socket.onopen = () => {
      greeted = true;
      this.viewer.openedLine(performance.now());
      this.send();
    };
    socket.onmessage = (event: MessageEvent) => {
      if (this.socket === socket) this.receive(event.data);
    };
    socket.onclose = (event: CloseEvent) => {
      if (this.socket !== socket) return;
      this.socket = null;
      if (greeted) this.viewer.lostLine();
      if (!this.ended) this.lost(event.code, event.reason, greeted);
    };
  }

  // A server that is lost is tried again for as long as the page is there, as is one that could not be reached at all.
  private lost(code: number, reason: string, greeted: boolean): void {
    // What the client did wrong (4400 and on) would be wrong again; but for 4408, which is that it was too slow.
    if (code === kServerFailed || (code >= 4400 && code !== kTimedOut)) return this.fail(reason || `the server ended the session with code ${code}`);
    if (greeted) this.attempt = 0;
    const wait = Math.min(kFirstWait * 2 ** this.attempt, kLongestWait) * (0.5 + 0.5 * Math.random());
    ++this.attempt;
    const why = !greeted ? 'the server cannot be reached' : code === kGoingAway ? 'the server shuts down' : 'the connection was lost';
    report({ type: 'connection', state: { state: 'waiting', seconds: wait / 1000, attempt: this.attempt, reason: why } });
    this.timer = setTimeout(() => this.connect(), wait) as unknown as number;
  }

  private fail(text: string): void {
    if (this.ended) return;
    this.ended = true;
    clearTimeout(this.timer);
    this.socket?.close(kNormal);
    this.socket = null;
    report({ type: 'error', text });
    report({ type: 'connection', state: { state: 'closed' } });
  }

  private receive(data: unknown): void {
    if (!(data instanceof ArrayBuffer)) return this.fail('the server sent text');
    const before = this.viewer.updates();
    const start = performance.now();
    this.viewer.inbox(data.byteLength).set(new Uint8Array(data));
    const wrong = this.viewer.receive(start);
    const end = performance.now();
    if (wrong) {
      if (this.viewer.faultCode() !== kGoingAway) return this.fail(wrong);
      return; // the close that follows says so
    }
    this.send();
    const updates = this.viewer.updates();
    if (updates > before) {
      this.busy.updates += updates - before;
      this.busy.seconds += (end - start) / 1000;
    }
    if (this.viewer.wasOpened()) {
      const fresh = this.viewer.isFresh();
      if (fresh) this.all = true;
      this.attempt = 0;
      this.opened = true;
      report({ type: 'connection', state: { state: 'open' } });
      report({ type: 'opened', dataset: this.viewer.dataset(), resumed: !fresh });
    }
    this.changed = true;
    if (this.version === 0 && updates > 0) return this.draw(); // the first one at once: messages that are waiting would come before a turn
    this.tellProgress(this.viewer.done());
    this.plan();
  }

  private send(): void {
    for (const message of this.viewer.takeMessages()) {
      if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(message);
    }
  }

  // Not more often than now and then, but always the last state.
  private tellProgress(now: boolean): void {
    if (!this.opened) return;
    const wait = this.progressAt + kProgressInterval - performance.now();
    if (!now && wait > 0) {
      if (this.progressTimer === 0) this.progressTimer = setTimeout(() => this.tellProgress(true), wait) as unknown as number;
      return;
    }
    clearTimeout(this.progressTimer);
    this.progressTimer = 0;
    this.progressAt = performance.now();
    const progress = this.viewer.progress();
    const done = progress.done && !this.changed; // not before the page was sent the skin with all of it
    report({
      type: 'progress',
      progress: { ...progress, done, skin: this.version, memory: this.core.HEAPU8.byteLength, busy: { ...this.busy } },
    });
  }

  private plan(): void {
    if (this.turn !== 0 || !this.opened || !this.changed || this.shown !== this.version) return;
    const rest = this.version === 0 || this.viewer.done() ? 0 : Math.max(kLeastSkinInterval, this.skinTime);
    this.turn = setTimeout(() => this.draw(), Math.max(0, this.skinEnd + rest - performance.now())) as unknown as number;
  }

  private draw(): void {
    this.turn = 0;
    if (this.ended || !this.changed || this.shown !== this.version) return;
    const start = performance.now();
    this.changed = false;
    const skin = this.viewer.skin(this.edges, this.all);
    this.all = false;
    if (skin.pieces.length > 0 || skin.removed.length > 0 || skin.reset) {
      ++this.version;
      const buffers = skin.pieces.flatMap((piece) => [piece.vertices, piece.indices, ...(piece.edges ? [piece.edges] : [])]);
      report({ type: 'skin', skin: { ...skin, version: this.version } }, buffers);
    }
    if (this.plane) this.cut();
    if (this.box) this.showTets();
    this.skinEnd = performance.now();
    this.skinTime = this.skinEnd - start;
    this.tellProgress(this.viewer.done());
  }
}

function base64url(text: string): string {
  const bytes = String.fromCharCode(...new TextEncoder().encode(text));
  return btoa(bytes).replaceAll('+', '-').replaceAll('/', '_').replaceAll('=', '');
}

const loading = createCore({ locateFile: () => wasmUrl });
let session: Session | null = null;
let view: View | null = null;
let edges = false;
let plane: Plane | null = null;
let box: Box | null = null;

async function handle(request: Request): Promise<void> {
  const core = await loading;
  switch (request.type) {
    case 'open':
      session?.close();
      session = new Session(core, request.url, request.dataset, request.token);
      Object.assign(session, { edges, plane, box });
      if (view) session.look(view);
      break;
    case 'view':
      view = request.view;
      session?.look(view);
      break;
    case 'clip':
      plane = request.plane;
      if (session) session.plane = plane;
      session?.cut();
      break;
    case 'tets':
      box = request.box;
      if (session) session.box = box;
      session?.showTets();
      break;
    case 'edges':
      if (edges === request.wanted) break;
      edges = request.wanted;
      if (session) session.edges = edges;
      session?.drawEverything();
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
    case 'close':
      session?.close();
      session = null;
      break;
  }
}

// In order, also while the core is still loading.
let last: Promise<void> = Promise.resolve();
scope.onmessage = (event: MessageEvent<Request>) => {
  last = last.then(() => handle(event.data)).catch((error: unknown) => report({ type: 'error', text: `the viewer's core failed: ${String(error)}` }));
};
loading.then(
  () => report({ type: 'ready' }),
  (error: unknown) => report({ type: 'error', text: `the viewer's core cannot be loaded: ${String(error)}` }),
);
