// INTERVALE_CORE_DIR: the folder with core.js and core.wasm, as CMake makes them; without it the page builds, and says that it has no core.
// INTERVALE_VIEWER_OUT: where the page goes.
import { existsSync } from 'node:fs';
import { resolve } from 'node:path';
import { defineConfig, type Plugin } from 'vite';

function clientCore(folder: string | undefined): Plugin {
  return {
    name: 'client-core',
    enforce: 'pre',
    resolveId(id) {
      if (!id.startsWith('@core/')) return null;
      const path = resolve(folder ?? '.', id.slice('@core/'.length));
      if (folder && existsSync(path.replace(/\?.*$/, ''))) return path;
      return '\0' + id;
    },
    load(id) {
      if (id === '\0@core/core.js') return 'export default () => Promise.reject(new Error("This build of the page has no client core."));';
      if (id.startsWith('\0@core/')) return 'export default "";';
      return null;
    },
  };
}

// The page brings shaders of its own, so those of three.js stay at home: a quarter of what the page would be. They are all behind one object, by which
// `#include` finds them.
function withoutShaders(): Plugin {
  let met = false;
  return {
    name: 'without-shaders',
    enforce: 'pre',
    load(id) {
      if (!id.endsWith('/three/src/renderers/shaders/ShaderChunk.js')) return null;
      met = true;
      return 'export const ShaderChunk = {};';
    },
    buildEnd(error) {
      if (!error && !met) this.error('three.js keeps its shaders elsewhere than it did: see withoutShaders in vite.config.ts');
    },
  };
}

export default defineConfig(() => {
  const core = () => clientCore(process.env.INTERVALE_CORE_DIR);
  return {
    base: './', // works below any path
    plugins: [core(), withoutShaders()],
    resolve: { alias: [{ find: /^three$/, replacement: 'three/src/Three.js' }] },
    worker: { format: 'es' as const, plugins: () => [core()] },
    build: {
      outDir: process.env.INTERVALE_VIEWER_OUT ?? 'dist',
      emptyOutDir: true,
      target: 'es2022',
      cssTarget: ['chrome123', 'firefox120', 'safari17.5'], // light-dark()
      assetsInlineLimit: 0, // the server's Content-Security-Policy has no data: but for pictures
      modulePreload: { polyfill: false },
      chunkSizeWarningLimit: 700, // three.js, 130 kB on the wire
    },
  };
});
