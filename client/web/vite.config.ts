// Environment: INTERVALE_VIEWER_OUT, the output folder. The client core, which CMake builds, is to lie in
// package/src/core.
import { defineConfig, type Plugin } from 'vite';

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

export default defineConfig({
  base: './', // relative: the page may be served below any path
  plugins: [withoutShaders()],
  resolve: { alias: [{ find: /^three$/, replacement: 'three/src/Three.js' }] },
  worker: { format: 'es' },
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
