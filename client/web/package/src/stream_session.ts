// A data set that is streamed, in the worker: feeds the client core with messages, and sends the page the mesh's changes.
//
// All messages that have arrived are applied before a new version of the surface is made, and that only after the page
// has shown the last one. Making versions takes at most about half of the time, so as not to slow down a fast stream.
import type { Core, Viewer } from './core/core.js';

import { Connection, type ConnectionHandler, kGoingAway } from './connection.js';
import type { Box, MeshFormat, Plane, Report, Request, SurfacePiece, Vec3, View } from './messages.js';
import { PortConnection } from './port_connection.js';
import { PreviewPace } from './preview_pace.js';

const kSurfaceIntervalMs = 40; // least time between two versions
const kProgressIntervalMs = 100;
const kRestMs = 200; // for which the mesh has rested before its stand-in is made again

const buffersOf = ({ vertices, values }: { vertices: ArrayBuffer; values: ArrayBuffer | null }) => (values ? [vertices, values] : [vertices]);
const buffersOfPieces = (pieces: SurfacePiece[]) =>
  pieces.flatMap((piece) => [...buffersOf(piece), piece.indices, ...(piece.edges ? [piece.edges] : [])]);

type SendReport = (report: Report, transfer?: Transferable[]) => void;

// What the page wants to be shown with the boundary surface. The worker changes it, and then calls the session.
export interface Extras {
  edges: boolean;
  values: boolean;
  plane: Plane | null;
  box: Box | null;
  volume: boolean;
  standIn: number | null; // triangles, at most
}

export class StreamSession {
  private viewer: Viewer;
  private connection: Connection | PortConnection;
  private isEnded = false;
  private isOpen = false; // there is a mesh; stays true while the connection is lost

  private version = 0; // of the last surface sent
  private shown = 0; // ... and of the one that the page shows
  private isChanged = false; // the mesh, since the last surface
  private needsAll = true; // the next surface has every piece
  private surfaceTimer = 0;
  private surfaceEnd = 0; // when the last one was finished, performance.now()
  private surfaceMs = 0; // what it took
  private previewed: [number, number][] | null = null; // to be shown once the page shows the last surface
  private pace = new PreviewPace();
  private isPreviewing = false; // since the last view
  private shows = ''; // ranges and region of the last view
  private eye: Vec3 = [0, 0, 0]; // of the last view
  private volume: { version: number; eye: Vec3 } | null = null; // the last one sent, and the eye of its last order
  // The last one made since the page was told that there is none: of which surface, and with how many triangles at most.
  private standIn: { of: number; most: number } | null = null;
  private standIns = 0; // sent
  private standInTimer = 0;

  private channel: string | null = null; // of the last view
  private viewNumber = 0; // the same
  private progressTime = 0; // when it was last reported
  private progressTimer = 0;
  private busy = { updates: 0, seconds: 0 };

  constructor(
    private readonly core: Core,
    private readonly request: Extract<Request, { type: 'open' }>,
    private readonly extras: Readonly<Extras>,
    private readonly report: SendReport,
  ) {
    this.viewer = new core.Viewer(request.dataset);
    const handler: ConnectionHandler = {
      connected: () => {
        this.viewer.connected(performance.now());
        this.send();
      },
      received: (message) => this.receive(message),
      disconnected: () => this.viewer.disconnected(),
      changed: (state) => report({ type: 'connection', state }),
      failed: (text) => this.fail(text),
    };
    const { to, token } = request;
    this.connection = typeof to === 'string' ? new Connection(to, token, handler) : new PortConnection(to, handler);
  }

  // Connects with the first view. number: for the progress.
  look(view: View, number: number): void {
    this.viewNumber = number;
    this.endPreview();
    const shows = JSON.stringify([view.ranges, view.region]);
    const isOther = shows !== this.shows;
    this.shows = shows;
    if (view.channel !== this.channel) this.needsAll = true;
    if (isOther || view.channel !== this.channel) this.dropStandIn();
    this.channel = view.channel;
    this.eye = view.camera.eye;
    const error = this.viewer.look(view);
    if (error) return this.fail(error);
    this.connection.start();
    this.send();
    this.isChanged = true; // another budget or another range shows other tetrahedra
    if (isOther && this.isOpen) this.sendSurface(); // without a pause
    this.reportProgress(true);
    this.scheduleSurface();
  }

  // Without waiting for the server or for a pause: this follows the hand.
  preview(ranges: [number, number][]): void {
    this.previewed = ranges;
    if (!this.isOpen) return this.answerPreview();
    if (this.shown === this.version) this.showPreview(ranges);
  }

  pageShows(version: number): void {
    this.shown = version;
    if (this.previewed && version === this.version) this.showPreview(this.previewed);
    else this.scheduleSurface();
  }

  private showPreview(ranges: [number, number][]): void {
    if (!this.isPreviewing) this.pace.begin(this.viewer.levelCounts());
    this.isPreviewing = true;
    this.dropStandIn();
    const start = performance.now();
    const error = this.viewer.preview(ranges, this.pace.levels);
    if (error) return this.fail(error);
    this.isChanged = true;
    this.sendSurface();
    this.pace.took(performance.now() - start);
    this.answerPreview();
  }

  private endPreview(): void {
    this.isPreviewing = false;
    if (this.previewed) this.answerPreview();
  }

  private answerPreview(): void {
    this.previewed = null;
    this.report({ type: 'preview' });
  }

  // Sends the surface again: edges or values are wanted, or not wanted any more.
  remake(): void {
    this.dropStandIn();
    this.needsAll = true;
    this.isChanged = true;
    this.reportProgress(true);
    this.scheduleSurface();
  }

  // At once if the mesh is the last surface's, else with the next surface. An empty one if there is no mesh yet.
  sendCap(): void {
    const { plane } = this.extras;
    const { version } = this;
    if (plane === null || version === 0) {
      return this.report({ type: 'cap', cap: { plane, vertices: new ArrayBuffer(0), values: null, triangles: [], version } });
    }
    if (this.viewer.isStale()) return this.scheduleSurface();
    const cap = this.viewer.cap(plane);
    this.report({ type: 'cap', cap: { ...cap, plane, version } }, buffersOf(cap));
  }

  // As sendCap().
  sendTets(): void {
    const { box } = this.extras;
    if (box === null || this.version === 0) {
      return this.report({ type: 'tets', tets: { box, vertices: new ArrayBuffer(0), values: null, count: 0, outOf: 0 } });
    }
    if (this.viewer.isStale()) return this.scheduleSurface();
    const tets = this.viewer.tets(box);
    this.report({ type: 'tets', tets: { ...tets, box } }, buffersOf(tets));
  }

  // Before its surface is sent, so that the page has it when it answers that. isOther: the mesh is not the last volume's.
  private sendVolume(version: number, isOther: boolean): void {
    const { eye, viewer } = this;
    if (isOther || !this.volume) {
      const volume = { ...viewer.volume(), order: viewer.volumeOrder(eye), version };
      this.volume = { version, eye };
      return this.report({ type: 'volume', volume }, [volume.points, volume.tets, volume.order]);
    }
    if (this.volume.eye.every((x, i) => x === eye[i])) return;
    this.volume.eye = eye;
    const order = viewer.volumeOrder(eye);
    this.report({ type: 'order', version: this.volume.version, order }, [order]);
  }

  private dropVolume(): void {
    this.volume = null;
    this.viewer.dropVolume();
  }

  close(): void {
    this.isEnded = true;
    this.connection.end();
    clearTimeout(this.surfaceTimer);
    clearTimeout(this.progressTimer);
    clearTimeout(this.standInTimer);
    this.viewer.delete();
  }

  save(format: MeshFormat): void {
    if (!this.isOpen) return this.report({ type: 'error', text: 'There is no mesh to save yet.' });
    const bytes = this.viewer.save(`mesh.${format}`);
    if (typeof bytes === 'string') return this.report({ type: 'error', text: `The mesh cannot be saved: ${bytes}` });
    this.report({ type: 'saved', format, name: `${this.request.dataset}.${format}`, bytes }, [bytes]);
  }

  probe(at: Vec3): void {
    this.report({ type: 'probed', at, values: this.viewer.probe(at) });
  }

  digest(): void {
    if (!this.isOpen) return;
    const { updatesInMesh, tets } = this.viewer.progress();
    this.report({ type: 'digest', digest: this.viewer.digest(), updates: updatesInMesh, tets });
  }

  private fail(text: string): void {
    if (this.isEnded) return;
    this.isEnded = true;
    this.connection.end();
    this.report({ type: 'error', text });
    this.report({ type: 'connection', state: { state: 'closed' } });
  }

  private send(): void {
    for (const message of this.viewer.takeMessages()) this.connection.send(message);
  }

  private receive(message: ArrayBuffer): void {
    const before = this.viewer.updates();
    const start = performance.now();
    this.viewer.inbox(message.byteLength).set(new Uint8Array(message));
    const error = this.viewer.receive(start);
    const end = performance.now();
    if (error) {
      // A server that goes away closes the connection next, and that leads to a reconnection.
      if (this.viewer.faultCode() !== kGoingAway) this.fail(error);
      return;
    }
    this.send();
    const updates = this.viewer.updates();
    if (updates > before) {
      this.busy.updates += updates - before;
      this.busy.seconds += (end - start) / 1000;
    }
    if (this.viewer.wasOpened()) this.opened();
    this.isChanged = true;
    // The first surface at once: a timer would fire only after all messages that are queued.
    if (this.version === 0 && updates > 0) return this.sendSurface();
    this.reportProgress(this.viewer.done());
    this.scheduleSurface();
  }

  private opened(): void {
    const isNewMesh = this.viewer.isNewMesh();
    if (isNewMesh) this.needsAll = true;
    if (isNewMesh) this.dropStandIn();
    this.connection.accepted();
    this.isOpen = true;
    this.report({ type: 'connection', state: { state: 'open' } });
    this.report({ type: 'opened', resumed: !isNewMesh });
  }

  // Now, or when the interval since the last report is over: the last state is always reported.
  private reportProgress(now: boolean): void {
    if (!this.isOpen) return;
    const wait = this.progressTime + kProgressIntervalMs - performance.now();
    if (!now && wait > 0) {
      if (this.progressTimer === 0) this.progressTimer = self.setTimeout(() => this.reportProgress(true), wait);
      return;
    }
    clearTimeout(this.progressTimer);
    this.progressTimer = 0;
    this.progressTime = performance.now();
    const progress = this.viewer.progress();
    const done = progress.done && !this.isChanged; // not before the complete surface was sent
    const memory = this.core.HEAPU8.byteLength;
    const { version: surfaceVersion, busy, viewNumber: view } = this;
    this.report({ type: 'progress', progress: { ...progress, view, done, surfaceVersion, memory, busy: { ...busy } } });
  }

  private scheduleSurface(): void {
    if (this.surfaceTimer !== 0 || !this.isOpen || !this.isChanged || this.shown !== this.version) return;
    const pause = this.version === 0 || this.viewer.done() ? 0 : Math.max(kSurfaceIntervalMs, this.surfaceMs);
    const wait = Math.max(0, this.surfaceEnd + pause - performance.now());
    this.surfaceTimer = self.setTimeout(() => this.sendSurface(), wait);
  }

  private sendSurface(): void {
    clearTimeout(this.surfaceTimer);
    this.surfaceTimer = 0;
    if (this.isEnded || !this.isChanged || this.shown !== this.version) return;
    const start = performance.now();
    this.isChanged = false;
    const { edges, values: hasValues, volume } = this.extras;
    this.viewer.wantValues(hasValues, this.channel ?? '');
    const { isOtherMesh, ...change } = this.viewer.updateSurface(edges, this.needsAll);
    this.needsAll = false;
    this.send();
    const isOther = change.pieces.length > 0 || change.removed.length > 0 || change.reset.length > 0 || (volume && isOtherMesh);
    if (isOther) ++this.version;
    if (volume) this.sendVolume(this.version, isOther);
    else if (this.volume) this.dropVolume();
    if (isOther) {
      this.report({ type: 'surface', change: { ...change, version: this.version, hasValues } }, buffersOfPieces(change.pieces));
    }
    if (this.extras.plane) this.sendCap();
    if (this.extras.box) this.sendTets();
    this.surfaceEnd = performance.now();
    this.surfaceMs = this.surfaceEnd - start;
    this.reportProgress(this.viewer.done());
    this.scheduleStandIn();
  }

  // Another number of triangles is wanted, or none.
  wantStandIn(): void {
    if (this.extras.standIn === null) this.dropStandIn();
    this.scheduleStandIn();
  }

  // The page may also have one of another session.
  private dropStandIn(): void {
    clearTimeout(this.standInTimer);
    this.standInTimer = 0;
    this.standIn = null;
    this.report({ type: 'standIn', change: null });
  }

  // The first one soon, one that is too large likewise; one of the mesh as it is now once that is complete and rests.
  private scheduleStandIn(): void {
    const { standIn: most } = this.extras;
    clearTimeout(this.standInTimer);
    this.standInTimer = 0;
    if (most === null || this.version === 0 || this.isPreviewing) return;
    const isUrgent = !this.standIn || this.standIn.most > most;
    const isOld = !this.standIn || this.standIn.of !== this.version || this.standIn.most !== most;
    if (!isUrgent && !(isOld && this.viewer.done())) return;
    this.standInTimer = self.setTimeout(() => this.sendStandIn(most), isUrgent ? 0 : kRestMs);
  }

  private sendStandIn(most: number): void {
    this.standInTimer = 0;
    const { edges, values: hasValues } = this.extras;
    this.standIn = { of: this.version, most };
    const change = this.viewer.standIn(most, edges);
    if (!change) return this.report({ type: 'standIn', change });
    this.report({ type: 'standIn', change: { ...change, version: ++this.standIns, hasValues } }, buffersOfPieces(change.pieces));
  }
}
