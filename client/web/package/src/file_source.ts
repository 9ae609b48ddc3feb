// Where the worker of a file reads it from: a blob, or an address, in ranges if its server knows them.
//
// A header that names a range needs no consent of another origin's server in browsers of today; where one is refused
// nevertheless, the file is read whole. What is read in parts is checked page by page against the index at the file's
// beginning, so a file that changes meanwhile is refused and never mixed.

const kStartBytes = 64 << 10; // kStartBytes of common/ivm/coarse_scales.h
const kRangeBytes = 4 << 20; // of one request
const kAttempts = 4; // of one request
const kPauseMs = 500; // before the second; doubles with each
const kMostBytes = 2 ** 30; // the browser holds the file, and the core what it decodes to

export type Told = (received: number, size: number | null) => void; // size: of the file; null: not known

export interface FileSource {
  readonly size: number; // of the file, bytes
  readonly start: Uint8Array; // its first 64 KiB, or all
  // Bytes [first, end) of the file. Rejects, with a text for the user.
  read(first: number, end: number): Promise<Uint8Array>;
}

const tooLarge = () => new Error('it is too large to be shown by the page itself: serve it with intervale serve.');

// Of a file in memory.
class Whole implements FileSource {
  readonly size: number;
  readonly start: Uint8Array;

  constructor(private readonly bytes: Uint8Array) {
    this.size = bytes.length;
    this.start = bytes.subarray(0, kStartBytes);
  }

  read(first: number, end: number): Promise<Uint8Array> {
    return Promise.resolve(this.bytes.subarray(first, end));
  }
}

class BlobSource implements FileSource {
  readonly size: number;

  constructor(private readonly blob: Blob, readonly start: Uint8Array) {
    this.size = blob.size;
  }

  async read(first: number, end: number): Promise<Uint8Array> {
    return new Uint8Array(await this.blob.slice(first, end).arrayBuffer());
  }
}

const isTemporary = (status: number): boolean => status === 408 || status === 429 || status >= 500;

class UrlSource implements FileSource {
  private received: number;

  constructor(private readonly url: string, readonly size: number, readonly start: Uint8Array, private readonly tag: string | null, private readonly told: Told) {
    this.received = start.length;
  }

  async read(first: number, end: number): Promise<Uint8Array> {
    const bytes = new Uint8Array(end - first);
    for (let at = first; at < end; at += kRangeBytes) bytes.set(await this.range(at, Math.min(at + kRangeBytes, end)), at - first);
    return bytes;
  }

  private async range(first: number, end: number): Promise<Uint8Array> {
    for (let attempt = 1; ; ++attempt) {
      const response = await fetch(this.url, { headers: { Range: `bytes=${first}-${end - 1}` } }).catch(() => null);
      const bytes = response?.status === 206 ? await response.arrayBuffer().catch(() => null) : null;
      const tag = response?.headers.get('ETag') ?? null;
      if (response?.status === 206 && this.tag !== null && tag !== null && tag !== this.tag) throw new Error('it changed while it was read.');
      if (bytes?.byteLength === end - first) {
        this.told((this.received += bytes.byteLength), this.size);
        return new Uint8Array(bytes);
      }
      if (response && response.status !== 206 && (attempt === kAttempts || !isTemporary(response.status)))
        throw new Error(`its server responded with status ${response.status} on the way.`);
      if (attempt === kAttempts) throw new Error('the connection was lost.');
      await new Promise((resolve) => setTimeout(resolve, kPauseMs * 2 ** (attempt - 1)));
    }
  }
}

// All of an answer's body, as it arrives.
async function bodyOf(response: Response, told: Told): Promise<Uint8Array> {
  const size = response.headers.get('Content-Encoding') === null ? Number(response.headers.get('Content-Length')) || null : null;
  const chunks: Uint8Array[] = [];
  let received = 0;
  const reader = response.body!.getReader();
  for (let part = await reader.read(); !part.done; part = await reader.read()) {
    chunks.push(part.value);
    received += part.value.length;
    if (received > kMostBytes) {
      await reader.cancel();
      throw tooLarge();
    }
    told(received, size);
  }
  const bytes = new Uint8Array(received);
  let at = 0;
  for (const chunk of chunks) {
    bytes.set(chunk, at);
    at += chunk.length;
  }
  return bytes;
}

// The length of the file that the header of an .ivm file tells (FORMAT.md); null if these bytes have none.
const lengthIn = (start: Uint8Array): number | null =>
  start.length < 24 ? null : Number(new DataView(start.buffer, start.byteOffset).getBigUint64(16, true));

async function openUrl(url: string, told: Told): Promise<FileSource> {
  const range = { headers: { Range: `bytes=0-${kStartBytes - 1}` } };
  const response = (await fetch(url, range).catch(() => null)) ?? (await fetch(url).catch(() => null));
  if (!response)
    throw new Error('it cannot be reached, or this page may not read it: its server (Access-Control-Allow-Origin) or the page\'s (--connect-origin) does not allow that.');
  if (response.status === 416) return new Whole(new Uint8Array());
  if (!response.ok || !response.body) throw new Error(`it was not received: the server responded with status ${response.status}.`);
  if (response.status !== 206) return new Whole(await bodyOf(response, told));
  const start = await bodyOf(response, told);
  const total = /\/(\d+)$/.exec(response.headers.get('Content-Range') ?? '')?.[1]; // not told to pages of other origins
  const size = total === undefined ? lengthIn(start) : Number(total);
  if (size === null || size <= start.length) return new Whole(start);
  if (size > kMostBytes) throw tooLarge();
  return new UrlSource(url, size, start, response.headers.get('ETag'), told);
}

// from: a file, or an absolute address. told: called as bytes of an address arrive. Rejects, with a text for the user.
export async function openSource(from: Blob | string, told: Told): Promise<FileSource> {
  if (typeof from === 'string') return openUrl(from, told);
  if (from.size > kMostBytes) throw tooLarge();
  return new BlobSource(from, new Uint8Array(await from.slice(0, kStartBytes).arrayBuffer()));
}
