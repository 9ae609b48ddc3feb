// What shows files without a server, as client/web/local/bindings.cpp binds it. The build puts local.js and local.wasm
// beside this file.

// A returned text is an error; an empty one means success.
export interface LocalDataSet {
  inbox(bytes: number): Uint8Array; // to be filled with bytes of the file; valid until the next call of any function
  begin(name: string, fileBytes: number): string; // the inbox has the file's first 64 KiB, or all; name: the file's without its extension
  startBytes(): number; // that begin() needs: if more than it had, it is to be called again with these
  coarseCount(): number; // how many times more and more of the data set can be loaded before all of it
  firstBytes(i: number): number; // what is needed for that: bytes at the file's beginning
  lastBytes(i: number): number; // and at its end; the same for all i
  loadCoarse(i: number): string; // reads these from the inbox, the first ones first
  load(): string; // reads all of the file from the inbox
  checkRoom(i: number): string; // an error if there is no memory for the i-th of coarseCount(), or after those for all
  describe(): string; // JSON, as a server's /api/datasets/NAME
  delete(): void;
}
export interface LocalSession {
  inbox(bytes: number): Uint8Array; // to be filled with one message; valid until the next call of any function
  receive(): void; // handles the message in the inbox
  step(): ArrayBuffer | null; // works for a while, and returns a message if there is one
  grow(): void; // more of the data set was loaded
  endGrowth(): void; // nothing more of it will be: views are done with what is there
  isIdle(): boolean; // nothing is left to do before the next message, or before the data set grows
  delete(): void;
}
export interface Local {
  LocalDataSet: new () => LocalDataSet;
  LocalSession: new (set: LocalDataSet) => LocalSession;
}
declare const createLocal: (options: { locateFile: (path: string) => string }) => Promise<Local>;
export default createLocal;
