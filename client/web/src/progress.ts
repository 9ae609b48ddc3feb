// How far the view is refined: the status line below the picture, and the statistics in the panel.
import { volumeUnit } from '../package/src/datasets';
import { create, element, setText } from './dom';
import { bounded, bytes, count, short } from './format';
import type { Progress } from '../package/src/messages';
import type { Status } from './status';
import type { Store } from './store';

const kIntervalMs = 100; // between two updates of the page

// The state in a few words.
function summary(status: Readonly<Status>): string {
  const { connection, progress, dataset } = status;
  if (status.error !== null) return 'Stopped';
  if (status.needsToken) return 'Waiting for a token';
  if (connection.state === 'waiting') return 'Connection lost';
  if (connection.state === 'connecting' && !progress) return 'Connecting…';
  if (!dataset) return 'Loading…';
  if (progress?.done) return progress.full ? 'Done: memory limit reached' : 'Done for this view';
  return 'Refining…';
}

export function watchProgress(status: Store<Status>): void {
  let timer = 0;
  const show = () => {
    timer = 0;
    const { value } = status;
    setText(element('progress-text'), summary(value));
    showBar(value);
    showStatusLine(value);
    showStatistics(value);
  };
  status.watch([], () => {
    if (timer === 0) timer = window.setTimeout(show, kIntervalMs);
  });
  show();
}

function showBar({ progress, error, connection }: Readonly<Status>): void {
  const isDone = progress?.done && connection.state === 'open';
  element('status').className = error !== null ? 'bad' : connection.state === 'waiting' ? 'waiting' : isDone ? 'done' : '';
  const share = progress ? (progress.done ? 1 : progress.updates / Math.max(1, progress.updates + progress.updatesToGo)) : 0;
  element('bar').setAttribute('aria-valuenow', String(Math.round(100 * share)));
  element('bar-fill').style.transform = `scaleX(${share.toFixed(4)})`;
}

// The remaining error in units of the field. null: not known, since views limited by the screen-space error report 0.
function fieldError({ progress: p, dataset }: Readonly<Status>): string | null {
  return p && (p.remainingError > 0 || !dataset || p.updatesShown >= dataset.updates) ? short(p.remainingError) : null;
}

const total = (volumes: number[]): number => volumes.reduce((sum, volume) => sum + volume, 0);
const screenError = (p: Progress): string => `${short(p.remainingPixels)} px`;

function showStatusLine(status: Readonly<Status>): void {
  const p = status.progress;
  const field = fieldError(status);
  const parts: [value: string, label: string][] = [];
  if (p) {
    parts.push([screenError(p), 'error']);
    if (field !== null) parts.push([field, 'field error']);
    parts.push([bytes(p.bytes), ''], [count(p.updates), 'updates'], [count(p.tets), 'tetrahedra']);
    parts.push([bounded(total(p.volumes), p.volumeBound), volumeUnit(status.dataset)]);
  }
  element('status-values').replaceChildren(
    ...parts.map(([value, label]) => create('span', {}, create('b', {}, value), label && ` ${label}`)),
  );
}

function statistics(status: Readonly<Status>): [name: string, value: string][] {
  const { progress: p, dataset } = status;
  if (!p) return [['Received', 'nothing yet']];
  const unit = volumeUnit(status.dataset);
  const each = p.volumes.length > 1 ? p.volumes.map((volume, i): [string, string] => [`Volume of range ${i + 1}`, `${bounded(volume, null)} ${unit}`]) : [];
  const rows: [string, string][] = [
    ['Volume', `${bounded(total(p.volumes), p.volumeBound)} ${unit}`],
    ...each,
    ['Screen-space error', screenError(p)],
  ];
  const field = fieldError(status);
  if (field !== null) {
    const percent = dataset && dataset.maxError > 0 ? ` (${short((100 * p.remainingError) / dataset.maxError)} %)` : '';
    rows.push(['Field error', field + percent]);
  }
  rows.push(
    ['Tetrahedra', count(p.tets)],
    ['Triangles', count(p.triangles)],
    ['Updates', p.updatesShown < p.updates ? `${count(p.updates)}, ${count(p.updatesShown)} shown` : count(p.updates)],
    ['Updates remaining', p.done ? 'none' : `at most ${count(p.updatesToGo)}`],
    ['Received', bytes(p.bytes)],
    ['Memory', bytes(p.memory)],
  );
  if (p.busy.seconds > 0) rows.push(['Updates per second', count(p.busy.updates / p.busy.seconds)]);
  if (p.reconnects > 0) rows.push(['Reconnections', String(p.reconnects)]);
  return rows;
}

function showStatistics(status: Readonly<Status>): void {
  const rows = statistics(status);
  const list = element('statistics');
  // The elements are kept, so that their text can be selected while numbers change.
  while (list.children.length < 2 * rows.length) list.append(create(list.children.length % 2 === 0 ? 'dt' : 'dd', {}));
  while (list.children.length > 2 * rows.length) list.lastElementChild!.remove();
  rows.forEach(([name, value], i) => {
    setText(list.children[2 * i]!, name);
    setText(list.children[2 * i + 1]!, value);
  });
}
