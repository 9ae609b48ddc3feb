// The panel of controls: shows the view's state, and changes it.
import type { Dataset } from '../package/src/datasets';
import { create, element, input, onClick, setText } from './dom';
import { bytes, count, short } from './format';
import { rangeOf } from '../package/src/ranges';
import { kSurfaces } from '../package/src/colors';
import { exclusive, type ViewState } from './state';
import type { Status } from './status';
import type { Store } from './store';

// The positions of the sliders; null: no limit.
const kTetBudgets = [null, 10e3, 20e3, 50e3, 100e3, 200e3, 500e3, 1e6, 2e6, 5e6, 10e6];
const kMemoryBudgets = [null, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000]; // MB
const kFrameRates = [null, 5, 10, 15, 20, 30, 60, 120]; // null: any

// What is reset when another data set is chosen: values of the last one, and coordinates in its box.
export const kReset: Partial<ViewState> = { range: null, ranges: [], span: null, opacity: null, pose: null, clip: null, region: null, tets: false };

// The slider of the screen-space error: from 0.5 pixels, ten positions per doubling.
const kLeastPixels = 0.5;
const pixelsAt = (position: number): number => Number((kLeastPixels * 2 ** (position / 10)).toPrecision(3));
const positionOf = (pixels: number): number => Math.round(10 * Math.log2(pixels / kLeastPixels));

// The position of the choice nearest to a value.
function nearest(choices: (number | null)[], value: number | null): number {
  if (value === null) return 0;
  const distance = (i: number) => Math.abs(choices[i]! - value);
  return choices.reduce<number>((best, _, i) => (i > 0 && distance(i) < distance(best) ? i : best), 1);
}

export function watchPanel(view: Store<ViewState>, status: Store<Status>): void {
  watchSurfaces(view, status);
  watchSwitches(view);
  watchSliders(view);
  status.watch(['tets'], ({ tets }) => setText(element('tets-note'), tetsNote(tets)));
  status.watch(['datasets', 'dataset'], ({ datasets, dataset }) =>
    showDatasets(datasets, dataset, (name) => view.set({ dataset: name, ...kReset })),
  );
  onClick('panel-toggle', () => {
    const isOpen = element('panel').classList.toggle('open');
    element('panel-toggle').setAttribute('aria-expanded', String(isOpen));
  });
}

function tetsNote(tets: Status['tets']): string {
  if (!tets) return '';
  const all = `${count(tets.outOf)} tetrahedra`;
  if (tets.count === tets.outOf) return `${all} in the region`;
  return `The region has ${all}, of which ${count(tets.count)} are shown. Choose a smaller region to see all of them.`;
}

function watchSurfaces(view: Store<ViewState>, status: Store<Status>): void {
  for (const name of kSurfaces) {
    const [color, opacity] = [input(`${name}-color`), input(`${name}-opacity`)];
    color.addEventListener('input', () => view.set({ [name]: { ...view.value[name], color: color.value } }));
    opacity.addEventListener('input', () => view.set({ [name]: { ...view.value[name], opacity: opacity.valueAsNumber } }));
    view.watch([name], ({ [name]: style }) => {
      color.value = style.color;
      opacity.value = String(style.opacity);
      setText(element(`${name}-out`), `${Math.round(style.opacity * 100)} %`);
    });
  }
  const showValues = () => {
    const { dataset } = status.value;
    const range = dataset && (rangeOf(dataset, view.value.range) ?? dataset.range);
    const value = (x: number) => `${dataset?.field || 'field'} = ${short(x)} ${dataset?.fieldUnit ?? ''}`.trimEnd();
    setText(element('alpha-value'), range ? value(range[0]) : '');
    setText(element('beta-value'), range ? value(range[1]) : '');
  };
  status.watch(['dataset'], showValues);
  view.watch(['range'], showValues);
  view.watch(['ranges'], ({ ranges }) => (element('surface-styles').hidden = ranges.length > 0)); // several have one style each
}

function watchSwitches(view: Store<ViewState>): void {
  for (const name of ['wireframe', 'levels', 'thickness', 'probe'] as const) {
    input(name).addEventListener('change', () => view.set(exclusive({ [name]: input(name).checked })));
    view.watch([name], (value) => (input(name).checked = value[name]));
  }
}

function watchSliders(view: Store<ViewState>): void {
  const [pixels, tets, memory, rate] = [input('pixel-error'), input('max-tets'), input('memory'), input('frame-rate')];
  pixels.addEventListener('input', () => view.set({ pixelError: pixelsAt(pixels.valueAsNumber) }));
  tets.addEventListener('input', () => view.set({ maxTets: kTetBudgets[tets.valueAsNumber] ?? null }));
  memory.addEventListener('input', () => view.set({ memory: kMemoryBudgets[memory.valueAsNumber] ?? null }));
  rate.addEventListener('input', () => view.set({ frameRate: kFrameRates[rate.valueAsNumber] ?? 0 }));
  view.watch(['pixelError', 'maxTets', 'memory', 'frameRate'], (value) => {
    pixels.value = String(positionOf(value.pixelError));
    tets.value = String(nearest(kTetBudgets, value.maxTets));
    memory.value = String(nearest(kMemoryBudgets, value.memory));
    rate.value = String(nearest(kFrameRates, value.frameRate || null));
    setText(element('frame-rate-out'), value.frameRate === 0 ? 'any' : `${short(value.frameRate)} a second`);
    setText(element('pixel-error-out'), `${short(value.pixelError)} px`);
    setText(element('max-tets-out'), value.maxTets === null ? 'no limit' : `at most ${count(value.maxTets)}`);
    setText(element('memory-out'), value.memory === null ? 'no limit' : `at most ${count(value.memory)} MB`);
  });
}

function showDatasets(datasets: Dataset[] | null, open: Dataset | null, choose: (name: string) => void): void {
  if (datasets === null) return;
  const list = element('datasets');
  if (datasets.length === 0) {
    list.replaceChildren(create('p', { className: 'hint' }, 'There are no data sets.'));
    return;
  }
  // The same list keeps its elements, and with them the keyboard's focus.
  const radios = [...list.querySelectorAll('input')];
  if (radios.length === datasets.length && radios.every((radio, i) => radio.value === datasets[i]!.name)) {
    for (const radio of radios) radio.checked = radio.value === open?.name;
    return;
  }
  const choices = datasets.map((dataset) => {
    const { name } = dataset;
    const radio = create('input', { type: 'radio', name: 'dataset', value: name, checked: name === open?.name });
    radio.addEventListener('change', () => choose(name));
    const title = create('span', { className: 'name' }, name);
    return create('label', { className: 'dataset' }, radio, title, summary(dataset));
  });
  list.replaceChildren(...choices);
}

function summary({ dims, range, values, hasEveryRange, fullTets, fullBytes }: Dataset): HTMLElement {
  const size = fullTets > 0 ? [`${count(fullTets)} tetrahedra`, bytes(fullBytes)] : [];
  const [low, high] = hasEveryRange ? values : range;
  const parts = [dims.join(' × '), `${short(low)} to ${short(high)}`, ...(hasEveryRange ? ['every range'] : []), ...size];
  return create('small', {}, ...parts.map((part) => create('span', {}, part)));
}
