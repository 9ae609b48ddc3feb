// What a view is, and how it is written into the address, so that it can be sent to a colleague. Pure.
//
// #data=NAME&eye=x,y,z&at=x,y,z&up=x,y,z&fov=30 and, where they are not as at first: px (pixel error), tets and mb (budgets), clip=nx,ny,nz,offset,
// roi=x0,y0,z0,x1,y1,z1, show (comma-separated: tets thickness wire levels), shrink, alpha beta box (rrggbb,opacity).
import type { Pose } from './camera';
import { kFov } from './camera';
import type { Box, Plane, Vec3 } from './messages';
import { cross, length, sub, unit } from './vec';

export interface Look {
  color: string; // #rrggbb
  opacity: number; // 0 to 1
}

export type SurfaceName = 'alpha' | 'beta' | 'box';
export const kSurfaces: readonly SurfaceName[] = ['alpha', 'beta', 'box']; // in the order of a piece's groups

export interface ViewState {
  dataset: string | null; // null: the first that the server has
  pose: Pose | null; // null: the whole data set
  pixelError: number;
  maxTets: number | null;
  memory: number | null; // MB for updates
  clip: Plane | null;
  region: Box | null;
  tets: boolean; // shrunken, in the region
  shrink: number;
  thickness: boolean;
  wireframe: boolean;
  levels: boolean;
  alpha: Look;
  beta: Look;
  box: Look;
}

export const kFirst: Readonly<ViewState> = {
  dataset: null,
  pose: null,
  pixelError: 1,
  maxTets: null,
  memory: null,
  clip: null,
  region: null,
  tets: false,
  shrink: 0.8,
  thickness: false,
  wireframe: false,
  levels: false,
  alpha: { color: '#3d7fd6', opacity: 1 },
  beta: { color: '#f0862a', opacity: 1 },
  box: { color: '#d8c49a', opacity: 1 },
};

const kFlags = ['tets', 'thickness', 'levels', 'wireframe'] as const;

// Seven digits: a hundredth of a pixel on any screen.
const write = (numbers: number[]): string => numbers.map((n) => String(Number(n.toPrecision(7)))).join(',');

export function toHash(state: ViewState): string {
  const parts: string[] = [];
  const put = (key: string, value: string) => parts.push(`${key}=${value}`);
  if (state.dataset !== null) put('data', encodeURIComponent(state.dataset));
  if (state.pose) {
    put('eye', write(state.pose.eye));
    put('at', write(state.pose.lookAt));
    put('up', write(state.pose.up));
    if (state.pose.fov !== kFov) put('fov', write([state.pose.fov]));
  }
  if (state.pixelError !== kFirst.pixelError) put('px', write([state.pixelError]));
  if (state.maxTets !== null) put('tets', write([state.maxTets]));
  if (state.memory !== null) put('mb', write([state.memory]));
  if (state.clip) put('clip', write([...state.clip.normal, state.clip.offset]));
  if (state.region) put('roi', write([...state.region.min, ...state.region.max]));
  const flags = kFlags.filter((flag) => state[flag]);
  if (flags.length > 0) put('show', flags.join(','));
  if (state.shrink !== kFirst.shrink) put('shrink', write([state.shrink]));
  for (const name of kSurfaces) {
    const look = state[name];
    if (look.color !== kFirst[name].color || look.opacity !== kFirst[name].opacity) put(name, `${look.color.slice(1)},${write([look.opacity])}`);
  }
  return parts.length > 0 ? '#' + parts.join('&') : '';
}

const kFar = 1e30; // beyond it, what is drawn in 32 bits is nowhere

// n numbers that are not too large, or null.
function read(text: string | null, n: number): number[] | null {
  const numbers = text === null ? [] : text.split(',').map((word) => (word.trim() === '' ? NaN : Number(word)));
  return numbers.length === n && numbers.every((x) => Math.abs(x) <= kFar) ? numbers : null;
}

// One that is not along the line of sight: as wished, or else what is nearest to it.
function upFor(eye: Vec3, lookAt: Vec3, wish: Vec3): Vec3 {
  const ahead = unit(sub(lookAt, eye));
  for (const up of [wish, [0, 0, 1], [0, 1, 0]] as Vec3[]) {
    if (length(cross(ahead, unit(up))) > 1e-3) return unit(up);
  }
  return [1, 0, 0];
}

function readOne(text: string | null, least: number, most: number): number | null {
  const number = read(text, 1);
  return number ? Math.min(most, Math.max(least, number[0]!)) : null;
}

// What is missing or makes no sense is as at first.
export function fromHash(hash: string): ViewState {
  const fields = new URLSearchParams(hash.replace(/^#/, '').replaceAll('+', '%2B'));
  const get = (key: string) => fields.get(key);
  const state: ViewState = { ...kFirst, dataset: get('data') };
  const eye = read(get('eye'), 3);
  const at = read(get('at'), 3);
  const up = read(get('up'), 3);
  if (eye && at && eye.some((x, i) => x !== at[i])) {
    state.pose = { eye: eye as Vec3, lookAt: at as Vec3, up: upFor(eye as Vec3, at as Vec3, (up ?? [0, 0, 1]) as Vec3), fov: readOne(get('fov'), 5, 120) ?? kFov };
  }
  state.pixelError = readOne(get('px'), 0.1, 64) ?? kFirst.pixelError;
  state.maxTets = readOne(get('tets'), 1, 1e9);
  state.memory = readOne(get('mb'), 1, 1e5);
  const clip = read(get('clip'), 4);
  if (clip && (clip[0] || clip[1] || clip[2])) state.clip = { normal: unit(clip.slice(0, 3) as Vec3), offset: clip[3]! };
  const roi = read(get('roi'), 6);
  if (roi) {
    const [a, b] = [roi.slice(0, 3), roi.slice(3)];
    state.region = { min: a.map((x, i) => Math.min(x, b[i]!)) as Vec3, max: a.map((x, i) => Math.max(x, b[i]!)) as Vec3 };
  }
  const shown = (get('show') ?? '').split(',');
  for (const flag of kFlags) state[flag] = shown.includes(flag);
  state.tets = state.tets && state.region !== null;
  state.shrink = readOne(get('shrink'), 0.4, 1) ?? kFirst.shrink;
  for (const name of kSurfaces) {
    const look = /^([0-9a-f]{6}),([0-9.e-]+)$/i.exec(get(name) ?? '');
    const opacity = readOne(look?.[2] ?? null, 0, 1);
    if (look && opacity !== null) state[name] = { color: '#' + look[1]!.toLowerCase(), opacity };
  }
  return state;
}
