// Environment: INTERVALE_CORE_DIR, the folder with core.js and core.wasm, which CMake builds; without it the page can
// be built, but reports that it has no core. INTERVALE_VIEWER_OUT, the output folder.
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
      if (id === '\0@core/core.js') return 'export default () => Promise.reject(new Error("this build of the page has no client core"));';
      if (id.startsWith('\0@core/')) return 'export default "";';
      return null;
    },
  };
}

// Leaves out the shaders of three.js, since the page has its own: they would be a quarter of its size. All of them are
// in one object, in which three.js looks up `#include`.
function withoutShaders(): Plugin {
  let isFound = false;
  return {
    name: 'without-shaders',
    enforce: 'pre',
    load(id) {
      if (!id.endsWith('/three/src/renderers/shaders/ShaderChunk.js')) return null;
      isFound = true;
      return 'export const ShaderChunk = {};';
    },
    buildEnd(error) {
      if (!error && !isFound) this.error('ShaderChunk.js of three.js was not found: update withoutShaders in vite.config.ts');
    },
  };
}

const core = () => clientCore(process.env.INTERVALE_CORE_DIR);

export default defineConfig({
  base: './', // relative: the page may be served below any path
  plugins: [core(), withoutShaders()],
  resolve: { alias: [{ find: /^three$/, replacement: 'three/src/Three.js' }] },
  worker: { format: 'es', plugins: () => [core()] },
  build: {
    outDir: process.env.INTERVALE_VIEWER_OUT ?? 'dist',
    emptyOutDir: true,
    target: 'es2022',
    cssTarget: ['chrome123', 'firefox120', 'safari17.5'], // light-dark()
    assetsInlineLimit: 0, // the server's Content-Security-Policy allows data: URLs for images only
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 700, // kB; three.js takes 130 compressed
  },
});
