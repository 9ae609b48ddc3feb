// Keeps the status current with what the mesh tells.
import type { LiveMesh } from '../package/src/live_mesh';
import { paletteOf } from './palette';
import type { Status } from './status';
import type { Store } from './store';

export function watchMesh(mesh: LiveMesh, status: Store<Status>): void {
  mesh.addEventListener('connection', ({ detail }) =>
    status.set({ connection: detail.state, ...(detail.state.state === 'open' ? { error: null } : {}) }),
  );
  mesh.addEventListener('opened', ({ detail }) => status.set({ opened: { times: status.value.opened.times + 1, resumed: detail.resumed } }));
  mesh.addEventListener('palettes', ({ detail }) => status.set({ palettes: detail.palettes.map(paletteOf) }));
  mesh.addEventListener('progress', ({ detail }) => status.set({ progress: detail.progress }));
  mesh.addEventListener('tets', ({ detail: { tets } }) => status.set({ tets: tets.box ? { count: tets.count, outOf: tets.outOf } : null }));
  mesh.addEventListener('saved', () => status.set({ saving: null }));
  mesh.addEventListener('load-error', ({ detail }) => status.set({ error: detail.text, saving: null, connection: { state: 'closed' } }));
}
