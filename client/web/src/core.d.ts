// The client core as a module: what bindings.cpp binds. Where it lies is said by INTERVALE_CORE_DIR when the page is built.
declare module '@core/core.js' {
  import type { Cap, Dataset, Plane, Box, Progress, Skin, Tets, View } from './messages';

  // Texts say what went wrong; empty ones, that nothing did.
  export interface Viewer {
    look(view: View): string;
    openedLine(milliseconds: number): void;
    lostLine(): void;
    inbox(bytes: number): Uint8Array; // to be filled with one message; valid until the next call of anything
    receive(milliseconds: number): string; // what lies in the inbox
    takeMessages(): ArrayBuffer[]; // to be sent, in order
    wasOpened(): boolean; // of the last receive: the server opened the session
    isFresh(): boolean; // ... and the mesh was begun afresh
    faultCode(): number; // after a failure that the server told; else 1000
    updates(): number;
    done(): boolean;
    dataset(): Dataset;
    progress(): Omit<Progress, 'skin' | 'memory' | 'busy'>;
    skin(edges: boolean, all: boolean): Omit<Skin, 'version'>;
    isStale(): boolean; // the mesh may have changed since the last skin: the next two must not be called
    cap(plane: Plane): Pick<Cap, 'vertices' | 'triangles'>;
    tets(box: Box): Omit<Tets, 'box'>;
    save(path: string): ArrayBuffer | string; // a file of the format that the path ends in; or why there is none
    digest(): string;
    delete(): void;
  }
  export interface Core {
    Viewer: new (dataset: string) => Viewer;
    HEAPU8: Uint8Array;
  }
  const createCore: (options: { locateFile: (path: string) => string }) => Promise<Core>;
  export default createCore;
}
declare module '@core/core.wasm?url' {
  const url: string;
  export default url;
}
