// The worker of one file that is shown without a server: it has the data set, and is what a server is for the sessions
// that connect to it by ports. It works in short steps, so that a new view does not wait for what an old one wants.
import createLocal, { type Local, type LocalDataSet, type LocalSession } from './core/local.js';

import type { LocalReply, LocalRequest } from './messages.js';

const scope = self as unknown as DedicatedWorkerGlobalScope;
const reply = (message: LocalReply) => scope.postMessage(message);

let local: Local | null = null; // while there is a data set
let set: LocalDataSet | null = null;

async function load({ file, name, wasmUrl }: Extract<LocalRequest, { type: 'load' }>): Promise<void> {
  const [loaded, bytes] = await Promise.all([
    createLocal({ locateFile: () => wasmUrl ?? new URL('./core/local.wasm', import.meta.url).href }),
    file.arrayBuffer(),
  ]);
  const made = new loaded.LocalDataSet();
  made.inbox(bytes.byteLength).set(new Uint8Array(bytes));
  const error = made.load(name);
  if (error) return reply({ type: 'error', text: error });
  [local, set] = [loaded, made];
  reply({ type: 'loaded', description: made.describe() });
}

// A session. Its messages are those of the WebSocket, but for a null of the client's, which ends it, and a text, which says
// why it ended here.
class Served {
  private readonly session: LocalSession;
  private readonly turn = new MessageChannel(); // takes its turn after the messages that have arrived: sooner than a timer
  private isWaiting = false; // for its turn

  constructor({ LocalSession }: Local, from: LocalDataSet, private readonly port: MessagePort) {
    this.session = new LocalSession(from);
    this.turn.port1.onmessage = () => this.guard(() => this.step());
    port.onmessage = ({ data }: MessageEvent<ArrayBuffer | null>) => this.guard(() => (data ? this.receive(data) : this.end()));
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

  private end(): void {
    this.turn.port1.close();
    this.port.close();
    this.session.delete();
  }

  private guard(work: () => void): void {
    try {
      work();
    } catch (error) {
      this.port.postMessage(`The file cannot be shown any more: ${String(error)}`);
      this.turn.port1.close();
      this.port.close();
    }
  }
}

scope.onmessage = ({ data }: MessageEvent<LocalRequest>) => {
  if (data.type === 'connect') {
    if (local && set) new Served(local, set, data.port);
    return;
  }
  load(data).catch((error: unknown) => reply({ type: 'error', text: `it cannot be read: ${String(error)}` }));
};
