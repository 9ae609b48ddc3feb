// The panel: what one chooses, as the view has it.
import { element, input, setText } from './dom';
import { bytes, count, short } from './format';
import type { Listed, Live } from './live';
import type { Dataset } from './messages';
import { kSurfaces, type ViewState } from './state';
import type { Store } from './store';

const kTetBudgets = [null, 10e3, 20e3, 50e3, 100e3, 200e3, 500e3, 1e6, 2e6, 5e6, 10e6];
const kMemoryBudgets = [null, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];

// What lies in a data set's box means nothing in another's.
const kOfTheBox: Partial<ViewState> = { pose: null, clip: null, region: null, tets: false };

// 0.5 to 16 pixels, ten steps a doubling.
const kLeastPixels = 0.5;
export const pixelsAt = (step: number): number => Number((kLeastPixels * 2 ** (step / 10)).toPrecision(3));
export const stepOf = (pixels: number): number => Math.round(10 * Math.log2(pixels / kLeastPixels));

const nearest = (choices: (number | null)[], value: number | null): number =>
  value === null ? 0 : choices.reduce<number>((best, choice, i) => (i > 0 && Math.abs(choice! - value) < Math.abs(choices[best]! - value) ? i : best), 1);

export const rangeText = ([low, high]: Dataset['range']): string => `${short(low)} to ${short(high)}`;

export function watchPanel(view: Store<ViewState>, live: Store<Live>): void {
  watchSurfaces(view, live);
  watchSwitches(view);
  watchSliders(view);
  live.watch(['tets'], ({ tets }) => {
    const all = `${count(tets?.outOf ?? 0)} tetrahedra`;
    const text = !tets ? '' : tets.count < tets.outOf ? `The region has ${all}: too many. ${count(tets.count)} of them are shown. A smaller region shows all.` : `${all} in the region`;
    setText(element('tets-note'), text);
  });
  live.watch(['datasets', 'dataset'], ({ datasets, dataset }) => showDatasets(datasets, dataset, (name) => view.set({ dataset: name, ...kOfTheBox })));
  element('panel-toggle').addEventListener('click', () => {
    const open = element('panel').classList.toggle('open');
    element('panel-toggle').setAttribute('aria-expanded', String(open));
  });
}

function watchSurfaces(view: Store<ViewState>, live: Store<Live>): void {
  for (const name of kSurfaces) {
    input(`${name}-color`).addEventListener('input', (event) => view.set({ [name]: { ...view.value[name], color: (event.target as HTMLInputElement).value } }));
    input(`${name}-opacity`).addEventListener('input', (event) =>
      view.set({ [name]: { ...view.value[name], opacity: (event.target as HTMLInputElement).valueAsNumber } }),
    );
    view.watch([name], ({ [name]: look }) => {
      input(`${name}-color`).value = look.color;
      input(`${name}-opacity`).value = String(look.opacity);
      setText(element(`${name}-out`), `${Math.round(look.opacity * 100)} %`);
    });
  }
  live.watch(['dataset'], ({ dataset }) => {
    setText(element('alpha-value'), dataset ? `field = ${short(dataset.range[0])}` : '');
    setText(element('beta-value'), dataset ? `field = ${short(dataset.range[1])}` : '');
  });
}

function watchSwitches(view: Store<ViewState>): void {
  for (const name of ['wireframe', 'levels', 'thickness'] as const) {
    input(name).addEventListener('change', () => view.set({ [name]: input(name).checked }));
    view.watch([name], (value) => (input(name).checked = value[name]));
  }
}

function watchSliders(view: Store<ViewState>): void {
  input('pixel-error').addEventListener('input', () => view.set({ pixelError: pixelsAt(input('pixel-error').valueAsNumber) }));
  input('max-tets').addEventListener('input', () => view.set({ maxTets: kTetBudgets[input('max-tets').valueAsNumber] ?? null }));
  input('memory').addEventListener('input', () => view.set({ memory: kMemoryBudgets[input('memory').valueAsNumber] ?? null }));
  view.watch(['pixelError', 'maxTets', 'memory'], ({ pixelError, maxTets, memory }) => {
    input('pixel-error').value = String(stepOf(pixelError));
    input('max-tets').value = String(nearest(kTetBudgets, maxTets));
    input('memory').value = String(nearest(kMemoryBudgets, memory));
    setText(element('pixel-error-out'), `${short(pixelError)} px`);
    setText(element('max-tets-out'), maxTets === null ? 'no limit' : `at most ${count(maxTets)}`);
    setText(element('memory-out'), memory === null ? 'no limit' : `${count(memory)} MB`);
  });
}

function showDatasets(datasets: Listed[] | null, open: Listed | null, choose: (name: string) => void): void {
  const list = element('datasets');
  if (datasets === null) return;
  if (datasets.length === 0) {
    list.replaceChildren(Object.assign(document.createElement('p'), { className: 'hint', textContent: 'This server has none.' }));
    return;
  }
  const known = [...list.querySelectorAll('input')];
  if (known.length === datasets.length && known.every((one, i) => one.value === datasets[i]!.name)) {
    for (const one of known) one.checked = one.value === open?.name;
    return;
  }
  list.replaceChildren(
    ...datasets.map((dataset) => {
      const label = Object.assign(document.createElement('label'), { className: 'dataset' });
      const radio = Object.assign(document.createElement('input'), { type: 'radio', name: 'dataset', value: dataset.name, checked: dataset.name === open?.name });
      radio.addEventListener('change', () => choose(dataset.name));
      const name = Object.assign(document.createElement('span'), { className: 'name', textContent: dataset.name });
      label.append(radio, name, summary(dataset));
      return label;
    }),
  );
}

function summary(d: Listed): HTMLElement {
  const parts = [d.dims.join(' × '), rangeText(d.range), ...(d.fullTets > 0 ? [`${count(d.fullTets)} tetrahedra`, bytes(d.fullBytes)] : [])];
  const line = document.createElement('small');
  line.append(...parts.map((text) => Object.assign(document.createElement('span'), { textContent: text })));
  return line;
}
