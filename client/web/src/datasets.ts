// What the server has: GET api/datasets, beside the page.
import type { Listed } from './live';
import type { Vec3 } from './messages';

export type Listing = { datasets: Listed[] } | { needsToken: true } | { trouble: string };

export async function listDatasets(token: string | null): Promise<Listing> {
  const url = new URL('api/datasets', document.baseURI);
  try {
    const answer = await fetch(url, token === null ? {} : { headers: { Authorization: `Bearer ${token}` } });
    if (answer.status === 401) return { needsToken: true };
    if (answer.status === 503) return { trouble: 'The server is still reading what it has.' };
    if (!answer.ok) return { trouble: `The server answers ${answer.status} when asked what it has.` };
    const body: unknown = await answer.json();
    const list = (body as { datasets?: unknown }).datasets;
    if (!Array.isArray(list)) return { trouble: 'What the server says it has cannot be understood: it may be of another version than this page.' };
    return { datasets: list.map(parsed).filter((d) => d !== null) };
  } catch {
    return { trouble: 'The server does not answer. It may have been stopped, or the network is down.' };
  }
}

// The address of the stream, beside the page.
export function streamUrl(): string {
  const url = new URL('v1/stream', document.baseURI);
  url.protocol = url.protocol === 'https:' ? 'wss:' : 'ws:';
  url.hash = '';
  return url.href;
}

const number = (x: unknown): number => (x === 'inf' ? Infinity : x === '-inf' ? -Infinity : typeof x === 'number' ? x : 0);
const vec = (x: unknown): Vec3 => (Array.isArray(x) && x.length === 3 ? [number(x[0]), number(x[1]), number(x[2])] : [0, 0, 0]);

function parsed(entry: unknown): Listed | null {
  const d = entry as Record<string, unknown>;
  if (typeof d?.['name'] !== 'string') return null;
  const full = (d['full'] ?? {}) as Record<string, unknown>;
  const range = Array.isArray(d['range']) ? d['range'] : [];
  return {
    name: d['name'],
    dims: vec(d['dims']),
    spacing: vec(d['spacing']),
    origin: vec(d['origin']),
    range: [number(range[0]), number(range[1])],
    maxError: number(d['max_error']),
    updates: number(d['updates']),
    fullTets: number(full['tets']),
    fullVertices: number(full['vertices']),
    fullBytes: number(full['indexed_bytes']),
    refine: String(d['refine'] ?? ''),
  };
}
