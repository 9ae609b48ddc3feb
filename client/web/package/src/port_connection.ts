// The connection to a data set that is in another worker (local_worker.ts): as that to a server, but it is never lost.
import type { ConnectionHandler } from './connection.js';

export class PortConnection {
  private isStarted = false;

  constructor(private readonly port: MessagePort, private readonly handler: ConnectionHandler) {}

  start(): void {
    if (this.isStarted) return;
    this.isStarted = true;
    const { handler, port } = this;
    port.onmessage = ({ data }: MessageEvent<ArrayBuffer | string>) => (typeof data === 'string' ? handler.failed(data) : handler.received(data));
    handler.changed({ state: 'connecting' });
    handler.connected();
  }

  send(message: ArrayBuffer): void {
    if (this.isStarted) this.port.postMessage(message, [message]);
  }

  accepted(): void {}

  end(): void {
    this.port.onmessage = null;
    this.port.postMessage(null);
    this.port.close();
  }
}
