// The page, built into dist/ (or INTERVALE_VIEWER_OUT), served under the server's Content-Security-Policy with a stand-in for the worker, and a
// headless Chromium (INTERVALE_CHROMIUM) that draws in software.
import { createServer } from 'node:http';
import { readFile } from 'node:fs/promises';
import { extname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { chromium } from 'playwright-core';

const here = fileURLToPath(new URL('.', import.meta.url));
const kDist = process.env.INTERVALE_VIEWER_OUT ?? join(here, '../dist');
const kTypes = { '.html': 'text/html; charset=utf-8', '.js': 'text/javascript', '.css': 'text/css', '.svg': 'image/svg+xml', '.wasm': 'application/wasm' };
const kPolicy =
  "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self' ws: wss:; worker-src 'self'; font-src 'self'";
// What the stand-in does goes by the name: see fake_worker.js.
const kDatasets = ['gyroid', 'lost', 'broken', 'full'].map((name) => ({
  name, dims: [49, 49, 49], spacing: [1, 1, 1], origin: [-24, -24, -24], range: [-0.45, 0.75], refine: 'boundary', max_error: 0.61,
  updates: 48000, coefficients: 90000, full: { vertices: 41000, tets: 197000, indexed_bytes: 3.6e6 },
}));

// token: what api/datasets wants to be shown; none without it.
export async function startStand(token = null) {
  const server = createServer(async (request, response) => {
    const path = new URL(request.url, 'http://x').pathname;
    const send = (body, type) => response.writeHead(200, { 'content-type': type, 'content-security-policy': kPolicy }).end(body);
    if (path === '/api/datasets') {
      if (token !== null && request.headers.authorization !== `Bearer ${token}`) return response.writeHead(401).end();
      return send(JSON.stringify({ datasets: kDatasets }), 'application/json');
    }
    try {
      const file = /\/worker-[^/]*\.js$/.test(path) ? join(here, 'fake_worker.js') : join(kDist, path === '/' ? 'index.html' : path);
      send(await readFile(file), kTypes[extname(file)] ?? 'application/octet-stream');
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((done) => server.listen(0, '127.0.0.1', done));
  return { address: `http://127.0.0.1:${server.address().port}/`, close: () => server.close() };
}

export const launch = () =>
  chromium.launch({
    executablePath: process.env.INTERVALE_CHROMIUM ?? '/usr/bin/chromium',
    args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
  });

// A page whose complaints (console errors, exceptions, violations of the policy) gather in `complaints`.
export async function openPage(browser, url, { width = 1280, height = 800, theme = 'dark', touch = false } = {}) {
  const context = await browser.newContext({ viewport: { width, height }, colorScheme: theme, hasTouch: touch, acceptDownloads: true });
  const page = await context.newPage();
  page.complaints = [];
  page.on('console', (message) => ['error', 'warning'].includes(message.type()) && page.complaints.push(message.text()));
  page.on('pageerror', (error) => page.complaints.push(String(error)));
  await page.addInitScript(() => document.addEventListener('securitypolicyviolation', (event) => console.error(`policy: ${event.violatedDirective} ${event.blockedURI}`)));
  await page.goto(url);
  return page;
}

export const untilDone = (page) => page.waitForFunction(() => window.intervale?.progress?.done && window.intervale.stats.frames > 0, null, { timeout: 60_000 });
export const settled = (page) => page.evaluate(() => new Promise((done) => setTimeout(() => requestAnimationFrame(() => requestAnimationFrame(done)), 200)));

// What is drawn, without handles: width, height, and red, green, blue, alpha of each pixel.
export async function pixels(page) {
  const { width, height, data } = await page.evaluate(async () => {
    const bitmap = await createImageBitmap(await window.intervale.photograph());
    const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
    const context = canvas.getContext('2d');
    context.drawImage(bitmap, 0, 0);
    const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
    let text = '';
    for (let i = 0; i < data.length; i += 32768) text += String.fromCharCode(...data.subarray(i, i + 32768));
    return { width: canvas.width, height: canvas.height, data: btoa(text) };
  });
  return { width, height, data: Buffer.from(data, 'base64') };
}

// The share of pixels that differ by more than 24 of 255 in a channel.
export function difference(a, b) {
  if (a.width !== b.width || a.height !== b.height) return 1;
  let n = 0;
  for (let i = 0; i < a.data.length; i += 4) {
    if ([0, 1, 2].some((c) => Math.abs(a.data[i + c] - b.data[i + c]) > 24)) n++;
  }
  return (4 * n) / a.data.length;
}

// The share of pixels for which `is` holds.
export function share(picture, is) {
  let n = 0;
  for (let i = 0; i < picture.data.length; i += 4) if (is(picture.data[i], picture.data[i + 1], picture.data[i + 2])) n++;
  return (4 * n) / picture.data.length;
}
