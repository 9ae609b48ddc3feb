// The worker of one file that is shown without a server: it has the data set, and is what a server is for the sessions
// that connect to it by ports. It works in short steps, so that a new view does not wait for what an old one wants.
//
// A data set of every range is shown as soon as the file's beginning is there, with its coarse scales. Sessions get the
// finer ones as these arrive; if they do not, what is there stays, and views are done with it.
import createLocal, { type Local, type LocalDataSet, type LocalSession } from './core/local.js';

import { type FileSource, openSource } from './file_source.js';
import type { LocalReply, LocalRequest } from './messages.js';

const scope = self as unknown as DedicatedWorkerGlobalScope;
const reply = (message: LocalReply) => scope.postMessage(message);

let local: Local | null = null; // while there is a data set
let set: LocalDataSet | null = null;
let isGrown = false; // nothing more of it will be loaded
const sessions = new Set<Served>();

// Joins what is read of a file to what was read before.
class FirstBytes {
  private bytes: Uint8Array;

  constructor(private readonly source: FileSource) {
    this.bytes = source.start;
  }

  async until(end: number): Promise<Uint8Array> {
    if (end > this.bytes.length) {
      const more = await this.source.read(this.bytes.length, end);
      const joined = new Uint8Array(end);
      joined.set(this.bytes);
      joined.set(more, this.bytes.length);
      this.bytes = joined;
    }
    return this.bytes.subarray(0, end);
  }
}

function put(made: LocalDataSet, parts: Uint8Array[]): void {
  const inbox = made.inbox(parts.reduce((sum, { length }) => sum + length, 0));
  let at = 0;
  for (const part of parts) {
    inbox.set(part, at);
    at += part.length;
  }
}

// Loads it as it arrives. loaded: called with what there is, first and each time it grows. Rejects, with a text for the
// user; what was loaded stays.
async function loadFrom(source: FileSource, name: string, made: LocalDataSet, loaded: () => void): Promise<void> {
  const check = (error: string) => {
    if (error) throw new Error(error);
  };
  const first = new FirstBytes(source);
  put(made, [source.start]);
  check(made.begin(name, source.size));
  if (made.startBytes() > source.start.length) {
    put(made, [await first.until(made.startBytes())]);
    check(made.begin(name, source.size));
  }
  const count = made.coarseCount();
  const last = count > 0 ? source.read(source.size - made.lastBytes(0), source.size) : Promise.resolve(new Uint8Array());
  last.catch(() => undefined); // it is awaited below
  for (let i = 0; i < count; ++i) {
    check(made.checkRoom(i));
    const bytes = await first.until(made.firstBytes(i));
    put(made, [bytes, await last]);
    check(made.loadCoarse(i));
    loaded();
  }
  check(made.checkRoom(count));
  const end = await last;
  const bytes = await first.until(source.size - end.length);
  put(made, [bytes, end]);
  check(made.load());
  loaded();
}

async function load({ file, name, wasmUrl }: Extract<LocalRequest, { type: 'load' }>): Promise<void> {
  const [loaded, source] = await Promise.all([
    createLocal({ locateFile: () => wasmUrl ?? new URL('./core/local.wasm', import.meta.url).href }),
    openSource(file, (received, size) => reply({ type: 'received', received, size })),
  ]);
  const made = new loaded.LocalDataSet();
  await loadFrom(source, name, made, () => {
    if (set) return sessions.forEach((session) => session.grow());
    [local, set] = [loaded, made];
    reply({ type: 'loaded', description: made.describe() });
  });
}


// A session. Its messages are those of the WebSocket, but for a null of the client's, which ends it, and a text, which says
// why it ended here.
class Served {
  private readonly session: LocalSession;
  private readonly turn = new MessageChannel(); // takes its turn after the messages that have arrived: sooner than a timer
  private isWaiting = false; // for its turn

  constructor({ LocalSession }: Local, from: LocalDataSet, private readonly port: MessagePort) {
    this.session = new LocalSession(from);
    if (isGrown) this.session.endGrowth();
    sessions.add(this);
    this.turn.port1.onmessage = () => this.guard(() => this.step());
    port.onmessage = ({ data }: MessageEvent<ArrayBuffer | null>) => this.guard(() => (data ? this.receive(data) : this.end()));
  }

  // More of the file was loaded, or nothing more will be.
  grow(): void {
    this.guard(() => {
      if (isGrown) this.session.endGrowth();
      this.session.grow();
      this.schedule();
    });
  }

  private receive(message: ArrayBuffer): void {
    this.session.inbox(message.byteLength).set(new Uint8Array(message));
    this.session.receive();
    this.schedule();
  }

  private schedule(): void {
    if (this.isWaiting) return;
    this.isWaiting = true;
    this.turn.port2.postMessage(null);
  }

  private step(): void {
    this.isWaiting = false;
    const message = this.session.step();
    if (message) this.port.postMessage(message, [message]);
    if (message || !this.session.isIdle()) this.schedule();
  }

  private close(): void {
    sessions.delete(this);
    this.turn.port1.close();
    this.port.close();
  }

  private end(): void {
    this.close();
    this.session.delete();
  }

  private guard(work: () => void): void {
    try {
      work();
    } catch (error) {
      this.port.postMessage(`The file cannot be shown any more: ${String(error)}`);
      this.close();
    }
  }
}

scope.onmessage = ({ data }: MessageEvent<LocalRequest>) => {
  if (data.type === 'connect') {
    if (!local || !set) return;
    new Served(local, set, data.port);
    return;
  }
  load(data).catch((error: unknown) => {
    reply({ type: 'error', text: error instanceof Error ? error.message : String(error) });
    isGrown = true;
    sessions.forEach((session) => session.grow());
  });
};
