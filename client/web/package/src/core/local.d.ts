// What shows files without a server, as client/web/local/bindings.cpp binds it. The build puts local.js and local.wasm
// beside this file.

// A returned text is an error; an empty one means success.
export interface LocalDataSet {
  inbox(bytes: number): Uint8Array; // to be filled with the file; valid until the next call of any function
  load(name: string): string; // reads the inbox; name: the file's without its extension
  describe(): string; // JSON, as a server's /api/datasets/NAME
  delete(): void;
}
export interface LocalSession {
  inbox(bytes: number): Uint8Array; // to be filled with one message; valid until the next call of any function
  receive(): void; // handles the message in the inbox
  step(): ArrayBuffer | null; // works for a while, and returns a message if there is one
  isIdle(): boolean; // nothing is left to do before the next message
  delete(): void;
}
export interface Local {
  LocalDataSet: new () => LocalDataSet;
  LocalSession: new (set: LocalDataSet) => LocalSession;
}
declare const createLocal: (options: { locateFile: (path: string) => string }) => Promise<Local>;
export default createLocal;
