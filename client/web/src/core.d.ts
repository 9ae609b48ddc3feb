// The client core as emscripten makes it: where it lies is said by INTERVALE_CORE_DIR when the page is built.
declare module '@core/core.js' {
  const createCore: (options?: Record<string, unknown>) => Promise<any>;
  export default createCore;
}
declare module '@core/core.wasm?url' {
  const url: string;
  export default url;
}
