// How far the view has come: one line below the picture, and the figures in the panel.
import { element, setText } from './dom';
import { bounded, bytes, count, short } from './format';
import type { Live } from './live';
import type { Progress } from './messages';
import type { Store } from './store';

const kOften = 100; // ms between two looks at numbers

// What is said of a view, in words.
export function headline(live: Readonly<Live>): string {
  const { connection, progress, dataset } = live;
  if (live.trouble !== null) return 'Stopped';
  if (live.needsToken) return 'Waiting for a token';
  if (connection.state === 'waiting') return 'Connection lost';
  if (connection.state === 'connecting' && !progress) return 'Connecting…';
  if (!dataset) return 'Loading…';
  if (progress?.done) return progress.full ? 'Done: no room for more' : 'Done for this view';
  return 'Refining…';
}

export function watchProgress(live: Store<Live>): void {
  let timer = 0;
  const show = () => {
    timer = 0;
    const { value } = live;
    const { progress } = value;
    const done = progress?.done === true && value.trouble === null && value.connection.state === 'open';
    const waiting = value.connection.state === 'waiting';
    setText(element('progress-text'), headline(value));
    element('status').className = value.trouble !== null ? 'bad' : waiting ? 'waiting' : done ? 'done' : '';
    const share = progress ? (progress.done ? 1 : progress.updates / Math.max(1, progress.updates + progress.updatesToGo)) : 0;
    const bar = element('bar');
    bar.className = waiting ? 'waiting' : done ? 'done' : '';
    bar.setAttribute('aria-valuenow', String(Math.round(100 * share)));
    element('bar-fill').style.transform = `scaleX(${share.toFixed(4)})`;
    line(value);
    facts(value);
  };
  live.watch([], () => {
    if (timer === 0) timer = window.setTimeout(show, kOften);
  });
  show();
}

// What is left of the error in the field, where it is known: of a view that is done by pixels it is not.
function fieldError({ progress: p, dataset }: Readonly<Live>): string | null {
  return p && (p.remainingError > 0 || !dataset || p.updatesShown >= dataset.updates) ? short(p.remainingError) : null;
}

function line(live: Readonly<Live>): void {
  const p = live.progress;
  const field = fieldError(live);
  const target = element('figures');
  const parts: [string, string][] = p
    ? [
        [pixels(p), 'error'],
        ...(field === null ? [] : [[`± ${field}`, 'in the field'] as [string, string]]),
        [bytes(p.bytes), ''],
        [count(p.updates), 'updates'],
        [count(p.tets), 'tetrahedra'],
        [bounded(p.volume, p.volumeBound), 'units³'],
      ]
    : [];
  target.replaceChildren(
    ...parts.map(([value, unit]) => {
      const part = document.createElement('span');
      part.append(Object.assign(document.createElement('b'), { textContent: value }), unit && ` ${unit}`);
      return part;
    }),
  );
}

const pixels = (p: Progress): string => `${short(p.remainingPixels)} px`;

function facts(live: Readonly<Live>): void {
  const { progress: p, dataset } = live;
  const field = fieldError(live);
  const rows: [string, string][] = p
    ? [
        ['Volume', `${bounded(p.volume, p.volumeBound)} units³`],
        ['Error on screen', pixels(p)],
        ...(field === null ? [] : [['Error in the field', dataset && dataset.maxError > 0 ? `${field} (${short((100 * p.remainingError) / dataset.maxError)} %)` : field] as [string, string]]),
        ['Tetrahedra', count(p.tets)],
        ['Triangles', count(p.triangles)],
        ['Updates', p.updatesShown < p.updates ? `${count(p.updates)}, ${count(p.updatesShown)} shown` : count(p.updates)],
        ['Still to come', p.done ? 'none' : `at most ${count(p.updatesToGo)}`],
        ['Received', bytes(p.bytes)],
        ['Memory', bytes(p.memory)],
        ...(p.busy.seconds > 0 ? [['Updates in a second', count(p.busy.updates / p.busy.seconds)] as [string, string]] : []),
        ...(p.reconnects > 0 ? [['Reconnected', p.reconnects === 1 ? 'once' : `${p.reconnects} times`] as [string, string]] : []),
      ]
    : [['Received', 'nothing yet']];
  const list = element('facts');
  // Rows stay where they are, so that text in them can be selected while numbers change.
  while (list.children.length < 2 * rows.length) list.append(document.createElement(list.children.length % 2 === 0 ? 'dt' : 'dd'));
  while (list.children.length > 2 * rows.length) list.lastElementChild!.remove();
  rows.forEach(([name, value], i) => {
    setText(list.children[2 * i] as HTMLElement, name);
    setText(list.children[2 * i + 1] as HTMLElement, value);
  });
}
