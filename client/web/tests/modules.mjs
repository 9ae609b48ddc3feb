// The page's sources as modules, for tests without a browser: load('/src/state.ts').
import { after } from 'node:test';
import { createServer } from 'vite';

const server = await createServer({
  root: new URL('..', import.meta.url).pathname,
  configFile: false,
  logLevel: 'error',
  optimizeDeps: { noDiscovery: true },
  server: { middlewareMode: true, hmr: false, ws: false, watch: null },
  appType: 'custom',
});
after(() => server.close());

export const load = (path) => server.ssrLoadModule(path);
