// Serves the built page (INTERVALE_VIEWER_OUT, default dist/) with the server's Content-Security-Policy, with
// fake_worker.js in place of its worker; and opens it in a browser.
import assert from 'node:assert/strict';
import { createServer } from 'node:http';
import { readFile } from 'node:fs/promises';
import { extname, join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { difference, launch, pixels } from './browser.mjs';

const here = fileURLToPath(new URL('.', import.meta.url));
const kPage = process.env.INTERVALE_VIEWER_OUT ?? join(here, '../dist');
const kMimeTypes = {
  '.html': 'text/html; charset=utf-8',
  '.js': 'text/javascript',
  '.css': 'text/css',
  '.svg': 'image/svg+xml',
  '.wasm': 'application/wasm',
};
const kPolicy =
  "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data: blob:; " +
  "connect-src 'self' ws: wss:; worker-src 'self'; font-src 'self'";
// The name selects what the worker simulates: see fake_worker.js.
const kDatasets = ['gyroid', 'lost', 'broken', 'full'].map((name) => ({
  name, scope: 'one', dims: [49, 49, 49], affine: [1, 0, 0, -24, 0, 1, 0, -24, 0, 0, 1, -24], range: [-0.45, 0.75], refine: 'boundary',
  values: { least: -1.5, greatest: 1.5 }, step: 0.001, max_error: 0.61, updates: 48000, coefficients: 90000,
  full: { vertices: 41000, tets: 197000, indexed_bytes: 3.6e6 },
}));
const { range: _range, refine: _refine, full: _full, coefficients: _coefficients, ...common } = kDatasets[0];
kDatasets.push({ ...common, name: 'any', scope: 'every', channels: [{ name: 'heat', unit: 'K', values: { least: -1, greatest: 3 } }] });
// Values that are distributed evenly.
const kAny = {
  ...kDatasets.at(-1), histogram: Array(12).fill(1000), histogram_width: 0.25,
  volumes: { values: [-1.5, 1.5], below: [0, 1], not_above: [0, 1] },
};

// token: what api/datasets requires; null: nothing.
export async function startFakeServer(token = null) {
  const server = createServer(async (request, response) => {
    const path = new URL(request.url, 'http://x').pathname;
    const send = (body, type) => response.writeHead(200, { 'content-type': type, 'content-security-policy': kPolicy }).end(body);
    if (path === '/api/datasets') {
      if (token !== null && request.headers.authorization !== `Bearer ${token}`) return response.writeHead(401).end();
      return send(JSON.stringify({ datasets: kDatasets }), 'application/json');
    }
    if (path === '/api/datasets/any') return send(JSON.stringify(kAny), 'application/json');
    try {
      const isWorker = /\/worker-[^/]*\.js$/.test(path);
      const file = isWorker ? join(here, 'fake_worker.js') : join(kPage, path === '/' ? 'index.html' : path);
      send(await readFile(file), kMimeTypes[extname(file)] ?? 'application/octet-stream');
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  return { address: `http://127.0.0.1:${server.address().port}/`, close: () => server.close() };
}

// What the browser may say where a pixel is read back, as the probe does: it takes time.
const kStall = /GL Driver Message \(OpenGL, Performance, .*GPU stall due to ReadPixels/;

// The page at an address. Its `problems` collect console errors and warnings, exceptions, and violations of the policy.
// scale: of the resolution; a third, if not said, since software rendering takes as long as there are pixels. script: a
// function that runs in the page before its own scripts.
export async function openPage(browser, url, { width = 800, height = 560, theme = 'dark', scale = 0.35, script } = {}) {
  const context = await browser.newContext({ viewport: { width, height }, deviceScaleFactor: scale, colorScheme: theme, acceptDownloads: true });
  const page = await context.newPage();
  page.problems = [];
  const isProblem = (message) => ['error', 'warning'].includes(message.type()) && !kStall.test(message.text());
  page.on('console', (message) => isProblem(message) && page.problems.push(message.text()));
  page.on('pageerror', (error) => page.problems.push(String(error)));
  await page.addInitScript(() =>
    document.addEventListener('securitypolicyviolation', (event) => console.error(`policy: ${event.violatedDirective} ${event.blockedURI}`)),
  );
  if (script) await page.addInitScript(script);
  await page.goto(url);
  return page;
}

// What the tests of a file share: a browser and a server, from before the first test until after the last one; and
// onPage(name, run, options), a test on a page that shows the refined data set of options.hash. It fails also if the page
// has problems. options: of openPage(), too.
export function sharedPages() {
  const shared = {};
  before(async () => {
    [shared.browser, shared.server] = await Promise.all([launch(), startFakeServer()]);
  });
  after(async () => {
    await shared.browser.close();
    shared.server.close();
  });
  shared.onPage = (name, run, { hash = '#data=gyroid', ...options } = {}) =>
    test(name, async () => {
      const page = await openPage(shared.browser, shared.server.address + hash, options);
      await refined(page);
      await run(page);
      assert.deepEqual(page.problems, []);
      await page.context().close();
    });
  return shared;
}

// Until the view is completely refined and drawn.
export const refined = (page) =>
  page.waitForFunction(() => window.intervale?.progress?.done && window.intervale.stats.frames > 0, null, { timeout: 60_000 });

// Until the effects of an action are drawn. Requests leave with the next frame, or when a handle has rested; the worker
// answers them in order, and a picture may take long.
export const settled = (page) =>
  page.evaluate(async () => {
    const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));
    await new Promise((resolve) => setTimeout(resolve, 200));
    for (let k = 0; k < 2; ++k) await frame();
    const answer = window.intervale.next('digest');
    window.intervale.send({ type: 'digest' });
    await answer;
    do await frame();
    while (!window.intervale.isIdle);
  });

export const state = (page) => page.evaluate(() => window.intervale.state);

// Keeps what is sent to the worker from now on in window.requests.
export const recordRequests = (page) =>
  page.evaluate(() => {
    window.requests = [];
    const post = Worker.prototype.postMessage;
    Worker.prototype.postMessage = function (...message) {
      window.requests.push(message[0]);
      post.apply(this, message);
    };
  });

// That an action changes at least this share of the picture, within 15 s: some changes come from the worker.
export async function changesPicture(page, act, least = 0.01) {
  const old = await pixels(page);
  await act();
  let changed = 0;
  for (const end = Date.now() + 15_000; changed < least && Date.now() < end; ) {
    await settled(page);
    changed = difference(old, await pixels(page)).share;
  }
  assert.ok(changed >= least, `${changed} of the picture changed`);
}
