// The list of a server's data sets, and what it tells of each. base: the server's address, "https://host:port/"; paths
// below it may be given, too.
import type { Affine, Vec3 } from './messages.js';
import { cross, dot, scale } from './vec.js';

export interface Dataset {
  name: string;
  dims: Vec3; // samples
  affine: Affine; // from samples to the world
  unit: string; // of length; empty if not known, as the next two
  field: string; // what the values are
  fieldUnit: string; // of the values
  range: [number, number]; // closed, field units; may be infinite
  values: [number, number]; // the least and the greatest of the field
  channels: ChannelInfo[];
  hasEveryRange: boolean; // range is then from -Infinity to Infinity
  hasRangesWithin: boolean; // any range within `range` can be shown
  maxError: number; // of the coarsest mesh, field units
  updates: number; // of the full mesh
  fullTets: number;
  fullBytes: number; // of the full mesh as indexed arrays
}

// Another field that a data set has.
export interface ChannelInfo {
  name: string;
  unit: string; // empty if not known
  values: [number, number]; // the least and the greatest; of vectors, of their lengths
}

// Of a field, to choose a range by.
export interface Statistics {
  least: number; // the first bin begins here
  width: number; // of each bin
  counts: number[]; // samples by bin
  // Shares of the box, 0 to 1, where the field is below a value, and where it is not above it; linear in between.
  volumes: { values: number[]; below: number[]; notAbove: number[] };
}

export type Listing = { datasets: Dataset[] } | { needsToken: true } | { error: string };

// token: null if the user has given none.
export async function listDatasets(base: string | URL, token: string | null = null): Promise<Listing> {
  const url = new URL('api/datasets', base);
  try {
    const response = await fetch(url, token === null ? {} : { headers: { Authorization: `Bearer ${token}` } });
    if (response.status === 401) return { needsToken: true };
    if (response.status === 503) return { error: 'The server is still loading its data sets.' };
    if (!response.ok) return { error: `The list of data sets was not received: the server responded with status ${response.status}.` };
    const body: unknown = await response.json();
    const list = (body as { datasets?: unknown }).datasets;
    if (!Array.isArray(list)) return { error: 'The list of data sets cannot be read: the server may have another version than this page.' };
    return { datasets: list.map(datasetOf).filter((d) => d !== null) };
  } catch {
    return { error: 'The server does not respond. It may be stopped, or the network may be down.' };
  }
}

export const volumeUnit = (dataset: Dataset | null): string => `${dataset?.unit || 'units'}³`;

// Of the box of the samples, in cubic world units.
export function boxVolume({ dims, affine }: Dataset): number {
  const [x, y, z] = [0, 1, 2].map((j) => scale([affine[j]!, affine[4 + j]!, affine[8 + j]!], dims[j]! - 1));
  return Math.abs(dot(cross(x!, y!), z!));
}

// null: the data set has none, or the server did not send them.
export async function fetchStatistics(base: string | URL, dataset: Dataset, token: string | null = null): Promise<Statistics | null> {
  const url = new URL(`api/datasets/${encodeURIComponent(dataset.name)}`, base);
  try {
    const response = await fetch(url, token === null ? {} : { headers: { Authorization: `Bearer ${token}` } });
    return response.ok ? statisticsOf(await response.json(), dataset) : null;
  } catch {
    return null; // the range has number fields, too
  }
}

// The address of the server's WebSocket.
export function streamUrl(base: string | URL): string {
  const url = new URL('v1/stream', base);
  url.protocol = url.protocol === 'https:' ? 'wss:' : 'ws:';
  url.hash = url.search = '';
  return url.href;
}

const number = (x: unknown): number => (x === 'inf' ? Infinity : x === '-inf' ? -Infinity : typeof x === 'number' ? x : 0);
const numbers = (x: unknown): number[] => (Array.isArray(x) ? x.map(number) : []);
const vec = (x: unknown): Vec3 => (Array.isArray(x) && x.length === 3 ? [number(x[0]), number(x[1]), number(x[2])] : [0, 0, 0]);

const text = (x: unknown): string => (typeof x === 'string' ? x : '');
const kIdentity: Affine = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0];
const affine = (x: unknown): Affine => (Array.isArray(x) && x.length === 12 ? (x.map(number) as Affine) : kIdentity);

function channel(entry: unknown): ChannelInfo {
  const c = (entry ?? {}) as Record<string, unknown>;
  const values = (c['values'] ?? {}) as Record<string, unknown>;
  return { name: text(c['name']), unit: text(c['unit']), values: [number(values['least']), number(values['greatest'])] };
}

// Of what a server tells of a data set. null: there are none.
export function statisticsOf(entry: unknown, { values }: Dataset): Statistics | null {
  const body = (entry ?? {}) as Record<string, unknown>;
  const volumes = (body['volumes'] ?? {}) as Record<string, unknown>;
  const counts = numbers(body['histogram']);
  const width = number(body['histogram_width']);
  if (counts.length === 0 || !(width > 0)) return null;
  const table = { values: numbers(volumes['values']), below: numbers(volumes['below']), notAbove: numbers(volumes['not_above']) };
  return { least: values[0], width, counts, volumes: table };
}

// The same. null: not a data set.
export function datasetOf(entry: unknown): Dataset | null {
  const d = entry as Record<string, unknown>;
  if (typeof d?.['name'] !== 'string') return null;
  const full = (d['full'] ?? {}) as Record<string, unknown>;
  const values = (d['values'] ?? {}) as Record<string, unknown>;
  const hasEveryRange = d['scope'] === 'every';
  const range = hasEveryRange ? ['-inf', 'inf'] : Array.isArray(d['range']) ? d['range'] : [];
  return {
    name: d['name'],
    dims: vec(d['dims']),
    affine: affine(d['affine']),
    unit: text(d['unit']),
    field: text(d['field']),
    fieldUnit: text(d['field_unit']),
    range: [number(range[0]), number(range[1])],
    values: [number(values['least']), number(values['greatest'])],
    channels: Array.isArray(d['channels']) ? d['channels'].map(channel) : [],
    hasEveryRange,
    hasRangesWithin: hasEveryRange || d['refine'] === 'uniform',
    maxError: number(d['max_error']),
    updates: number(d['updates']),
    fullTets: number(full['tets']),
    fullBytes: number(full['indexed_bytes']),
  };
}
