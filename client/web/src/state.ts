// The state of the view, and how it is written into the fragment of the page's address, so that a link shows the same
// view. Pure functions. The fragment:
//
//   #data=NAME&eye=x,y,z&at=x,y,z&up=x,y,z&fov=30
//
// and, where they differ from the defaults: range=low,high (either may be -inf or inf), or several
// range=low,high,rrggbb,opacity; px (pixel error), tets and mb (budgets), fps (frame rate while the camera
// moves; 0: any), clip=nx,ny,nz,offset, roi=x0,y0,z0,x1,y1,z1, show (comma-separated: tets, thickness, levels, wireframe,
// probe), shrink, color=value, channel (a name), palette (a name),
// span=low,high, render=volume, opacity=value:opacity,value:opacity,..., and alpha, beta and box (each rrggbb,opacity).
import { kFov, type Pose } from '../package/src/camera';
import { kRangeColors, kSurfaceColors, kSurfaces, type SurfaceName } from '../package/src/colors';
import type { Box, Plane, Vec3 } from '../package/src/messages';
import { type OpacityCurve, readOpacity, writeOpacity } from './opacity';
import { clamp, cross, length, sub, unit } from '../package/src/vec';

export interface SurfaceStyle {
  color: string; // #rrggbb
  opacity: number; // 0 to 1
}

export type Styles = Record<SurfaceName, SurfaceStyle>; // of a range

export const kMostRanges = 4; // that are shown at once

// One of several ranges: its surfaces, and the inside, have one style.
export interface StyledRange {
  range: [number, number]; // of values, ascending
  style: SurfaceStyle;
}

export type ColorBy = 'surface' | 'value';
export type Render = 'surface' | 'volume';

export class ViewState {
  dataset: string | null = null; // null: the server's first
  pose: Pose | null = null; // null: shows the whole data set
  range: [number, number] | null = null; // of values, ascending; null: see rangeOf()
  ranges: readonly StyledRange[] = []; // two to four are shown in place of `range`; or none
  pixelError = 1; // largest screen-space error, pixels; 0.1 to 64
  maxTets: number | null = null; // null: no limit
  memory: number | null = null; // MB for updates; null: no limit
  frameRate = 60; // pictures a second while the camera moves, for which the mesh may be coarser; 0: always all of it
  clip: Plane | null = null;
  region: Box | null = null;
  tets = false; // shrunken tetrahedra in the region
  shrink = 0.8; // their size, 0.4 to 1
  thickness = false;
  wireframe = false;
  probe = false; // tells the value and the position under the pointer
  levels = false; // colour by level of detail
  colorBy: ColorBy = 'surface'; // value: of the field, or of `channel`
  channel: string | null = null; // whose values are shown and probed in place of the field's
  palette: string | null = null; // of values; null: the default
  span: [number, number] | null = null; // of values with colours of their own, ascending; null: see spanOf()
  render: Render = 'surface'; // volume: all tetrahedra, as a cloud
  opacity: OpacityCurve | null = null; // of values, in volume rendering; null: see defaultOpacity()
  alpha: SurfaceStyle = { color: kSurfaceColors.alpha, opacity: 1 };
  beta: SurfaceStyle = { color: kSurfaceColors.beta, opacity: 1 };
  box: SurfaceStyle = { color: kSurfaceColors.box, opacity: 1 };
}

export const kDefaults: Readonly<ViewState> = { ...new ViewState() };

// Of each range that is shown.
export const stylesOf = ({ ranges, alpha, beta, box }: Readonly<ViewState>): Styles[] =>
  ranges.length > 0 ? ranges.map(({ style }) => ({ alpha: style, beta: style, box: style })) : [{ alpha, beta, box }];

const kFlags = ['tets', 'thickness', 'levels', 'wireframe', 'probe'] as const;

// Whether colours are those of values of the field.
export const showsValues = ({ colorBy, render }: Readonly<ViewState>): boolean => colorBy === 'value' || render === 'volume';

// A change of the view, with what it rules out: colours show one thing at a time.
export function exclusive(change: Partial<ViewState>): Partial<ViewState> {
  if (change.colorBy === 'value' || change.render === 'volume') return { ...change, thickness: false, levels: false };
  return change.thickness || change.levels ? { ...change, colorBy: 'surface', render: 'surface' } : change;
}

// Seven digits: precise to a hundredth of a pixel on any screen.
const write = (numbers: number[]): string => numbers.map((n) => String(Number(n.toPrecision(7)))).join(',');

// Exactly: values decide what is inside.
const writeRange = (range: readonly number[]): string => range.map((x) => (Number.isFinite(x) ? String(x) : x < 0 ? '-inf' : 'inf')).join(',');
const writeStyle = ({ color, opacity }: SurfaceStyle): string => `${color.slice(1)},${write([opacity])}`;

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
  if (state.ranges.length > 0) for (const { range, style } of state.ranges) put('range', `${writeRange(range)},${writeStyle(style)}`);
  else if (state.range) put('range', writeRange(state.range));
  if (state.pixelError !== kDefaults.pixelError) put('px', write([state.pixelError]));
  if (state.maxTets !== null) put('tets', write([state.maxTets]));
  if (state.memory !== null) put('mb', write([state.memory]));
  if (state.frameRate !== kDefaults.frameRate) put('fps', write([state.frameRate]));
  if (state.clip) put('clip', write([...state.clip.normal, state.clip.offset]));
  if (state.region) put('roi', write([...state.region.min, ...state.region.max]));
  const flags = kFlags.filter((flag) => state[flag]);
  if (flags.length > 0) put('show', flags.join(','));
  if (state.shrink !== kDefaults.shrink) put('shrink', write([state.shrink]));
  if (state.colorBy !== kDefaults.colorBy) put('color', state.colorBy);
  if (state.channel !== null) put('channel', encodeURIComponent(state.channel));
  if (state.palette !== null) put('palette', encodeURIComponent(state.palette));
  if (state.span) put('span', state.span.join(','));
  if (state.render !== kDefaults.render) put('render', state.render);
  if (state.opacity) put('opacity', writeOpacity(state.opacity));
  for (const name of kSurfaces) {
    const style = state[name];
    const standard = kDefaults[name];
    if (style.color !== standard.color || style.opacity !== standard.opacity) put(name, writeStyle(style));
  }
  return parts.length > 0 ? '#' + parts.join('&') : '';
}

const kGreatest = 1e30; // greater coordinates would overflow float32 on the graphics card

// n comma-separated numbers, or null if there are not exactly n or one is too large.
function read(text: string | null, n: number): number[] | null {
  const numbers = text === null ? [] : text.split(',').map((word) => (word.trim() === '' ? NaN : Number(word)));
  return numbers.length === n && numbers.every((x) => Math.abs(x) <= kGreatest) ? numbers : null;
}

// Two ascending numbers, -inf or inf.
function readRange(words: string[]): [number, number] | null {
  const bounds = words.map((word) => {
    if (word === 'inf' || word === '-inf') return word === 'inf' ? Infinity : -Infinity;
    return word.trim() === '' ? NaN : Number(word);
  });
  const [low, high] = bounds;
  return bounds.length === 2 && low! <= high! && low !== Infinity && high !== -Infinity ? [low!, high!] : null;
}

function readStyle(text: string | null): SurfaceStyle | null {
  const style = /^([0-9a-f]{6}),([0-9.e-]+)$/i.exec(text ?? '');
  const opacity = readClamped(style?.[2] ?? null, 0, 1);
  return style && opacity !== null ? { color: '#' + style[1]!.toLowerCase(), opacity } : null;
}

// Those that are valid; the first four.
function readRanges(texts: string[]): StyledRange[] {
  const ranges = texts.flatMap((text) => {
    const words = text.split(',');
    const [range, style] = [readRange(words.slice(0, 2)), words.length > 2 ? readStyle(words.slice(2).join(',')) : undefined];
    return range && style !== null ? [{ range, style }] : [];
  });
  return ranges.slice(0, kMostRanges).map(({ range, style }, i) => ({ range, style: style ?? { color: kRangeColors[i]!, opacity: 1 } }));
}

// An up vector that is not parallel to the direction of view: the preferred one if possible.
function upFor(eye: Vec3, lookAt: Vec3, preferred: Vec3): Vec3 {
  const ahead = unit(sub(lookAt, eye));
  for (const up of [preferred, [0, 0, 1], [0, 1, 0]] as Vec3[]) {
    if (length(cross(ahead, unit(up))) > 1e-3) return unit(up);
  }
  return [1, 0, 0];
}

function readClamped(text: string | null, least: number, greatest: number): number | null {
  const number = read(text, 1);
  return number && clamp(number[0]!, least, greatest);
}

// Fields that are missing or invalid get their defaults; numbers out of range are clamped.
export function fromHash(hash: string): ViewState {
  const fields = new URLSearchParams(hash.replace(/^#/, '').replaceAll('+', '%2B'));
  const get = (key: string) => fields.get(key);
  const state: ViewState = { ...kDefaults, dataset: get('data') };
  const [eye, lookAt, up] = ['eye', 'at', 'up'].map((key) => read(get(key), 3) as Vec3 | null);
  if (eye && lookAt && eye.some((x, i) => x !== lookAt[i])) {
    state.pose = { eye, lookAt, up: upFor(eye, lookAt, up ?? [0, 0, 1]), fov: readClamped(get('fov'), 5, 120) ?? kFov };
  }
  const ranges = readRanges(fields.getAll('range'));
  if (ranges.length > 1) state.ranges = ranges;
  else state.range = ranges[0]?.range ?? null;
  state.pixelError = readClamped(get('px'), 0.1, 64) ?? kDefaults.pixelError;
  state.maxTets = readClamped(get('tets'), 1, 1e9);
  state.memory = readClamped(get('mb'), 1, 1e5);
  state.frameRate = readClamped(get('fps'), 0, 240) ?? kDefaults.frameRate;
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
  state.shrink = readClamped(get('shrink'), 0.4, 1) ?? kDefaults.shrink;
  state.channel = get('channel');
  state.palette = get('palette');
  const span = read(get('span'), 2);
  if (span && span[0]! <= span[1]!) state.span = [span[0]!, span[1]!];
  state.opacity = readOpacity(get('opacity'));
  for (const name of kSurfaces) {
    state[name] = readStyle(get(name)) ?? state[name];
  }
  const colored = get('color') === 'value' ? exclusive({ colorBy: 'value' }) : {};
  const rendered = get('render') === 'volume' ? exclusive({ render: 'volume' }) : {};
  return { ...state, ...colored, ...rendered };
}
