// The controls of the range: two number fields, and for data sets of every range the histogram of the field with two
// handles. An empty field is an infinite bound. While a handle moves, the page shows what was received of the range; the
// server is asked when it rests.
import { boxVolume, type Statistics, volumeUnit } from './datasets';
import { element, input, setText } from './dom';
import { short } from './format';
import { boundMoved, enclosedShare, type Range, rangeOf, rounded } from './range';
import type { ViewState } from './state';
import type { Status } from './status';
import type { Store } from './store';
import { clamp } from './vec';

type End = 0 | 1;
const kEnds: readonly End[] = [0, 1];
const kRestMs = 250; // a handle that does not move for so long rests
const kHeight = 48; // of the histogram's drawing; each bin is 1 wide
const kKeySteps: Record<string, number> = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -16, PageUp: 16 };

// preview: shows a range of what was received.
export function watchRange(view: Store<ViewState>, status: Store<Status>, preview: (range: Range) => void): void {
  const fields = [input('range-low'), input('range-high')];
  const handles = [element('range-handle-low'), element('range-handle-high')];
  const chart = element('histogram');
  let moving: Range | null = null; // by a handle, and not yet in the view
  let restTimer = 0;
  let restFrame = 0;

  const current = (): Range | null => {
    const { dataset } = status.value;
    return moving ?? (dataset && (rangeOf(dataset, view.value.range) ?? dataset.range));
  };
  const show = () => {
    const { dataset, statistics } = status.value;
    element('range-section').hidden = !dataset?.hasRangesWithin;
    const range = current();
    kEnds.forEach((end) => {
      const bound = range?.[end] ?? NaN;
      fields[end]!.value = Number.isFinite(bound) ? String(Number(bound.toPrecision(7))) : '';
    });
    chart.hidden = element('range-volume').hidden = !statistics;
    if (!dataset || !statistics || !range) return;
    kEnds.forEach((end) => placeHandle(handles[end]!, statistics, range[end]));
    const [from, to] = range.map((bound) => positionOf(statistics, bound));
    element('histogram-selection').setAttribute('x', String(from! * statistics.counts.length));
    element('histogram-selection').setAttribute('width', String((to! - from!) * statistics.counts.length));
    const share = enclosedShare(statistics, range);
    setText(element('range-volume'), `encloses ${short(share * boxVolume(dataset))} ${volumeUnit(dataset)}, ${(100 * share).toPrecision(3)} % of the box`);
  };
  const cancelRest = () => {
    window.clearTimeout(restTimer);
    window.cancelAnimationFrame(restFrame);
  };
  const commit = () => {
    cancelRest();
    if (moving) view.set({ range: moving });
    moving = null;
    show();
  };
  const move = (end: End, to: number) => {
    const range = current();
    const { dataset } = status.value;
    if (!range || !dataset) return;
    moving = boundMoved(range, end, to);
    preview(moving);
    show();
    cancelRest();
    // Moves arrive with frames: while one is drawn for longer than that, the handle may have moved on.
    restTimer = window.setTimeout(() => (restFrame = window.requestAnimationFrame(commit)), kRestMs);
  };

  fields.forEach((field, end) => {
    field.addEventListener('change', () => {
      const range = current();
      const to = field.value.trim() === '' ? (end === 0 ? -Infinity : Infinity) : field.valueAsNumber;
      if (range && !Number.isNaN(to)) view.set({ range: boundMoved(range, end as End, to) });
      show();
    });
  });
  kEnds.forEach((end) => watchHandle(handles[end]!, chart, () => status.value.statistics, () => current()?.[end] ?? NaN, (to) => move(end, to), commit));
  view.watch(['range'], show);
  status.watch(['dataset', 'statistics'], () => {
    moving = null;
    const { statistics } = status.value;
    if (statistics) draw(statistics);
    show();
  });
}

// Where a value lies between the ends of the histogram, 0 to 1.
const positionOf = ({ least, width, counts }: Statistics, value: number): number => clamp((value - least) / (width * counts.length), 0, 1);

function placeHandle(handle: HTMLElement, statistics: Statistics, value: number): void {
  handle.style.left = `${100 * positionOf(statistics, value)}%`;
  handle.setAttribute('aria-valuemin', String(statistics.least));
  handle.setAttribute('aria-valuemax', String(statistics.least + statistics.width * statistics.counts.length));
  handle.setAttribute('aria-valuenow', String(clamp(value, statistics.least, statistics.least + statistics.width * statistics.counts.length)));
  handle.setAttribute('aria-valuetext', short(value));
}

function watchHandle(
  handle: HTMLElement,
  chart: HTMLElement,
  statistics: () => Statistics | null,
  value: () => number,
  move: (to: number) => void,
  rest: () => void,
): void {
  const valueAt = (share: number): number => {
    const { least, width, counts } = statistics()!;
    return rounded(least + width * counts.length * clamp(share, 0, 1), width);
  };
  handle.addEventListener('pointerdown', (event) => {
    if (event.button === 0) handle.setPointerCapture(event.pointerId);
  });
  handle.addEventListener('pointermove', (event) => {
    if (!handle.hasPointerCapture(event.pointerId) || !statistics()) return;
    const { left, width } = chart.getBoundingClientRect();
    move(valueAt((event.clientX - left) / width));
  });
  handle.addEventListener('lostpointercapture', rest);
  handle.addEventListener('keydown', (event) => {
    const field = statistics();
    const steps = kKeySteps[event.key];
    if (!field || (steps === undefined && event.key !== 'Home' && event.key !== 'End')) return;
    event.preventDefault();
    const at = positionOf(field, value());
    move(valueAt(event.key === 'Home' ? 0 : event.key === 'End' ? 1 : at + steps! / field.counts.length));
  });
}

// Bars as high as the cube root of their counts: small peaks are seen beside large ones.
function draw({ counts }: Statistics): void {
  const most = Math.cbrt(Math.max(1, ...counts));
  const bars = counts.map((n, i) => `M${i} ${kHeight}V${(kHeight * (1 - Math.cbrt(n) / most)).toFixed(2)}h1V${kHeight}z`);
  element('histogram-drawing').setAttribute('viewBox', `0 0 ${counts.length} ${kHeight}`);
  element('histogram-bars').setAttribute('d', bars.join(''));
}
