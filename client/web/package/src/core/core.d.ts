// The client core, as client/web/core/bindings.cpp binds it. The build puts core.js and core.wasm beside this file.
import type { Box, Cap, Palette, Plane, Progress, SurfaceChange, Tets, Vec3, View, Volume } from '../messages.js';

// Times are milliseconds of performance.now(). A returned text is an error; an empty one means success.
export interface Viewer {
  look(view: View): string;
  // Shown until the next look(), of the updates that are here; the ranges that differ from the last view's without this
  // number of finest levels.
  preview(ranges: [number, number][], levels: number): string;
  levelCounts(): number[]; // how many updates stay without the finest levels, by the number of those: from 0 to all
  connected(now: number): void; // the WebSocket was opened
  disconnected(): void; // ... or closed
  inbox(bytes: number): Uint8Array; // to be filled with one message; valid until the next call of any function
  receive(now: number): string; // handles the message in the inbox
  takeMessages(): ArrayBuffer[]; // to be sent, in order
  wasOpened(): boolean; // the last receive() opened the session
  isNewMesh(): boolean; // ... and started a new mesh
  faultCode(): number; // the close code of an error that the server reported; else 1000
  updates(): number;
  done(): boolean;
  progress(): Omit<Progress, 'view' | 'surfaceVersion' | 'memory' | 'busy'>;
  // Whether pieces, caps and tetrahedra have values, the field's or a channel's, from the next updateSurface() on; if
  // so, that must be of all.
  wantValues(wanted: boolean, channel: string): void;
  // all: every piece, changed or not. isOtherMesh: tetrahedra changed, perhaps only some inside.
  updateSurface(edges: boolean, all: boolean): Omit<SurfaceChange, 'version' | 'hasValues'> & { isOtherMesh: boolean };
  // A coarser surface, of all its pieces; null: the last updateSurface() has no more than so many triangles.
  standIn(triangles: number, edges: boolean): Omit<SurfaceChange, 'version' | 'hasValues'> | null;
  isStale(): boolean; // the mesh may have changed since the last updateSurface(): cap(), tets() and volume() must not be called
  cap(plane: Plane): Pick<Cap, 'vertices' | 'values' | 'triangles'>;
  tets(box: Box): Omit<Tets, 'box'>;
  volume(): Pick<Volume, 'points' | 'tets'>; // empty without wantValues()
  volumeOrder(eye: Vec3): ArrayBuffer; // of the last volume()
  dropVolume(): void; // frees what volumeOrder() needs
  probe(at: Vec3): number[] | null;
  save(path: string): ArrayBuffer | string; // the file, in the format of the path's extension; or an error
  digest(): string;
  delete(): void;
}
export interface Core {
  Viewer: new (dataset: string) => Viewer;
  palettes(): Palette[]; // all, the default first
  HEAPU8: Uint8Array;
}
declare const createCore: (options: { locateFile: (path: string) => string }) => Promise<Core>;
export default createCore;
