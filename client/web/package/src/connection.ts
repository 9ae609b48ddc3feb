// The WebSocket to the server: connects, and reconnects when the connection is lost or could not be made.
import type { ConnectionState } from './messages.js';

// The wait before an attempt: doubles from the first to the longest; then between half and all of it, at random.
const kFirstWaitMs = 100;
const kLongestWaitMs = 3000;

// WebSocket close codes; see protocol/PROTOCOL.md.
const kNormal = 1000;
export const kGoingAway = 1001;
const kServerFailed = 1011;
const kFirstClientError = 4400;
const kTimedOut = 4408;

export interface ConnectionHandler {
  connected(): void;
  received(message: ArrayBuffer): void;
  disconnected(): void; // after connected()
  changed(state: ConnectionState): void; // connecting, or waiting for the next attempt
  failed(text: string): void; // for good; end() is to be called
}

export class Connection {
  private socket: WebSocket | null = null;
  private timer = 0; // of the next attempt
  private attempt = 0; // since a session was last open
  private isEnded = false;

  constructor(private readonly url: string, private readonly token: string | undefined, private readonly handler: ConnectionHandler) {}

  // Connects, unless it did before.
  start(): void {
    if (this.socket === null && this.timer === 0 && !this.isEnded) this.connect();
  }

  // Dropped while there is no connection.
  send(message: ArrayBuffer): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(message);
  }

  // The server accepted the session: the next loss starts with the shortest wait.
  accepted(): void {
    this.attempt = 0;
  }

  // Closes it for good. The handler is not called any more.
  end(): void {
    this.isEnded = true;
    clearTimeout(this.timer);
    this.socket?.close(kNormal);
    this.socket = null;
  }

  private connect(): void {
    this.timer = 0;
    if (this.attempt === 0) this.handler.changed({ state: 'connecting' });
    const protocols = ['intervale.v1'];
    if (this.token) protocols.push(`intervale.token.${base64url(this.token)}`);
    const socket = new WebSocket(this.url, protocols);
    socket.binaryType = 'arraybuffer';
    this.socket = socket;
    let wasConnected = false;
    socket.onopen = () => {
      wasConnected = true;
      this.handler.connected();
    };
    socket.onmessage = ({ data }: MessageEvent) => {
      if (this.socket !== socket) return;
      if (data instanceof ArrayBuffer) this.handler.received(data);
      else this.handler.failed('The server sent a text message.');
    };
    socket.onclose = ({ code, reason }: CloseEvent) => {
      if (this.socket !== socket) return;
      this.socket = null;
      if (wasConnected) this.handler.disconnected();
      this.retry(code, reason, wasConnected);
    };
  }

  // Tries again without end, also where the server was never reached: it may start later than the page.
  private retry(code: number, reason: string, wasConnected: boolean): void {
    // Client errors would occur again; except a time-out, which means that the network was too slow.
    if (code === kServerFailed || (code >= kFirstClientError && code !== kTimedOut)) {
      return this.handler.failed(reason || `The server closed the session with code ${code}.`);
    }
    if (wasConnected) this.attempt = 0;
    const wait = Math.min(kFirstWaitMs * 2 ** this.attempt, kLongestWaitMs) * (0.5 + 0.5 * Math.random());
    ++this.attempt;
    const lost = code === kGoingAway ? 'the server is shutting down' : 'the connection was interrupted';
    const cause = wasConnected ? lost : 'the server cannot be reached';
    this.handler.changed({ state: 'waiting', seconds: wait / 1000, attempt: this.attempt, reason: cause });
    this.timer = self.setTimeout(() => this.connect(), wait);
  }
}

function base64url(text: string): string {
  const bytes = String.fromCharCode(...new TextEncoder().encode(text));
  return btoa(bytes).replaceAll('+', '-').replaceAll('/', '_').replaceAll('=', '');
}
