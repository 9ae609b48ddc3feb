// A server with made data, a browser without a display, and what the tests ask of a page in it.
//
// INTERVALE_BIN: the programs' folder. INTERVALE_VIEWER_PAGE: where npm's packages of the viewer are. INTERVALE_WEB_OUT: where pictures are kept.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import net from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';

const kPatience = 60_000; // milliseconds, for anything to happen

const need = (name) => process.env[name] ?? assert.fail(`${name} is not set: run these tests by ctest -L web`);
const bin = need('INTERVALE_BIN');
const out = need('INTERVALE_WEB_OUT');
const references = fileURLToPath(new URL('references', import.meta.url));
mkdirSync(out, { recursive: true });
const { chromium } = createRequire(join(need('INTERVALE_VIEWER_PAGE'), 'package.json'))('playwright-core');

export const program = (name, ...args) => execFileSync(join(bin, name), args, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'ignore'] });

// A folder with interval volumes, which goes when the tests end. sample: where it is named otherwise.
export function makeData(...wanted) {
  const folder = mkdtempSync(join(tmpdir(), 'intervale-web-'));
  process.on('exit', () => rmSync(folder, { recursive: true, force: true }));
  for (const { name, sample = name, size, range } of wanted) {
    program('intervale', 'sample', sample, '--size', String(size), '-o', join(folder, `${name}.nrrd`));
    program('intervale', 'build', join(folder, `${name}.nrrd`), '-o', join(folder, `${name}.ivm`), '--range', ...range.map(String));
  }
  return folder;
}
export const kBuckyball = { name: 'buckyball', size: 65, range: [128, 188] };
export const kBlock = { name: 'block', sample: 'gyroid', size: 9, range: ['-inf', 'inf'] }; // the whole box is inside
export const kGyroid = { name: 'gyroid', size: 33, range: [-0.4, 0.4] };

const servers = new Set();
export const killServers = () => servers.forEach((server) => server.kill('SIGKILL'));

// A running `intervale serve`. port 0: any that is free.
export async function serve(folder, port = 0, ...options) {
  const server = spawn(join(bin, 'intervale'), ['serve', folder, '--listen', `127.0.0.1:${port}`, ...options], { stdio: ['ignore', 'ignore', 'pipe'] });
  process.on('exit', () => server.kill('SIGKILL'));
  servers.add(server);
  server.on('exit', () => servers.delete(server));
  let log = '';
  const address = await new Promise((resolve, reject) => {
    server.stderr.on('data', (text) => {
      log += text;
      const at = /http:\/\/(127\.0\.0\.1:\d+)\//.exec(log);
      if (at) resolve(at[1]);
    });
    server.on('exit', () => reject(new Error(`the server did not start: ${log}`)));
  });
  return {
    address,
    port: Number(address.split(':')[1]),
    url: `http://${address}/`,
    log: () => log,
    kill: (signal = 'SIGKILL') => new Promise((resolve) => (server.once('exit', resolve), server.kill(signal))),
  };
}

// A line to that port that carries so many bytes a second of a stream from the server, anything else as it comes, and breaks when the server does.
export async function slowLine(port, bytesPerSecond) {
  const relay = net.createServer((near) => {
    const far = net.connect(port, '127.0.0.1');
    let timer = null;
    const end = () => {
      clearInterval(timer);
      near.destroy();
      far.destroy();
    };
    for (const socket of [near, far]) socket.on('close', end).on('error', end);
    near.once('data', (request) => {
      far.write(request);
      near.pipe(far);
      if (!request.includes('/v1/stream')) return far.pipe(near);
      let queue = Buffer.alloc(0);
      far.on('data', (data) => {
        queue = Buffer.concat([queue, data]);
        far.pause();
      });
      timer = setInterval(() => {
        near.write(queue.subarray(0, bytesPerSecond / 20));
        queue = queue.subarray(bytesPerSecond / 20);
        if (queue.length === 0) far.resume();
      }, 50);
    });
  });
  await new Promise((resolve) => relay.listen(0, '127.0.0.1', resolve));
  relay.unref();
  return relay.address().port;
}

export const launch = () =>
  chromium.launch({
    executablePath: process.env.INTERVALE_CHROMIUM ?? '/usr/bin/chromium',
    args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
  });

// A page that is at this address, and everything that went wrong in it: errors in its console, among them what the Content-Security-Policy forbade.
export async function open(browser, url, { width = 800, height = 600, expected = [], ...options } = {}) {
  const context = await browser.newContext({ viewport: { width, height }, acceptDownloads: true, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(kPatience);
  const wrong = [];
  page.on('console', (message) => {
    if (message.type() === 'error' && !expected.some((text) => message.text().includes(text))) wrong.push(message.text());
  });
  let downloaded = 0; // of the page, its worker's files among it, as they came
  context.on('response', (response) => {
    if (!response.url().includes('/api/')) downloaded += Number(response.headers()['content-length'] ?? 0);
  });
  page.on('pageerror', (error) => wrong.push(String(error)));
  await page.goto(url);
  await page.waitForFunction(() => window.intervale !== undefined);
  return { page, wrong, downloaded: () => downloaded, close: () => context.close() };
}

// Until all that the view wants has come and is drawn.
export async function settled(page) {
  await page.waitForFunction(() => {
    const { progress, live, stats } = window.intervale;
    return progress?.done && live.connection.state === 'open' && stats.skinVersion === progress.skin;
  });
  await drawn(page);
}

// Until what the page asked of its worker has come back, and the next picture is drawn.
export async function drawn(page) {
  await page.evaluate(async () => {
    const answer = window.intervale.next('digest');
    window.intervale.send({ type: 'digest' });
    await answer;
    for (let k = 0; k < 3; ++k) await new Promise((resolve) => requestAnimationFrame(resolve));
  });
}

// The page's mesh: what the native client's --digest says of the same one.
export async function digestOf(page) {
  return page.evaluate(async () => {
    const answer = window.intervale.next('digest');
    window.intervale.send({ type: 'digest' });
    return answer;
  });
}

// Changes the view as if by hand, and waits for what follows.
export async function set(page, change) {
  await page.evaluate((change) => {
    window.intervale.set(change);
    return new Promise((resolve) => setTimeout(resolve, 250)); // views are sent ten times a second at most
  }, change);
  await settled(page);
}

export const progressOf = (page) => page.evaluate(() => window.intervale.progress);
export const skinOf = (page) => page.evaluate(() => ({ ...window.intervale.stats }));

// The canvas as it is drawn, as PNG in base 64; kept under this name.
export async function photograph(page, name) {
  const png = await page.evaluate(async () => {
    const blob = await window.intervale.photograph();
    return new Promise((resolve) => {
      const reader = new FileReader();
      reader.onload = () => resolve(reader.result.split(',')[1]);
      reader.readAsDataURL(blob);
    });
  });
  if (name) writeFileSync(join(out, `${name}.png`), Buffer.from(png, 'base64'));
  return png;
}

// How far two pictures differ: the mean over pixels and channels, 0 to 255, and the share of pixels that differ by more than 32 in any.
export async function difference(page, a, b) {
  return page.evaluate(
    async ([a, b]) => {
      const pixels = async (png) => {
        const bytes = Uint8Array.from(atob(png), (c) => c.charCodeAt(0));
        const bitmap = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
        const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
        const context = canvas.getContext('2d');
        context.drawImage(bitmap, 0, 0);
        return context.getImageData(0, 0, bitmap.width, bitmap.height);
      };
      const [p, q] = [await pixels(a), await pixels(b)];
      if (p.width !== q.width || p.height !== q.height) return { mean: 255, share: 1 };
      let sum = 0;
      let far = 0;
      for (let i = 0; i < p.data.length; i += 4) {
        let most = 0;
        for (let k = 0; k < 3; ++k) {
          const d = Math.abs(p.data[i + k] - q.data[i + k]);
          sum += d;
          most = Math.max(most, d);
        }
        if (most > 32) ++far;
      }
      const count = p.width * p.height;
      return { mean: sum / count / 3, share: far / count };
    },
    [a, b],
  );
}

// Compares a picture with the one that is kept in references/. INTERVALE_WEB_REMAKE=1 keeps this one instead.
export async function matches(page, name) {
  const png = await photograph(page, name);
  const path = join(references, `${name}.png`);
  if (process.env.INTERVALE_WEB_REMAKE) {
    mkdirSync(references, { recursive: true });
    writeFileSync(path, Buffer.from(png, 'base64'));
  }
  assert.ok(existsSync(path), `there is no reference ${path}`);
  const { mean, share } = await difference(page, png, readFileSync(path).toString('base64'));
  assert.ok(mean < 3 && share < 0.02, `${name}: differs by ${mean.toFixed(2)} in the mean, ${(100 * share).toFixed(1)} % of the pixels by much`);
  return png;
}

// The shares of pixels that are blue, orange and sand: the alpha surface, the beta surface and the inside.
export async function colours(page, png) {
  return page.evaluate(async (png) => {
    const bytes = Uint8Array.from(atob(png), (c) => c.charCodeAt(0));
    const bitmap = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
    context.drawImage(bitmap, 0, 0);
    const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
    let blue = 0;
    let orange = 0;
    let sand = 0;
    for (let i = 0; i < data.length; i += 4) {
      const [r, g, b] = [data[i], data[i + 1], data[i + 2]];
      if (Math.max(r, g, b) - Math.min(r, g, b) < 25) continue;
      if (b > r + 20) ++blue;
      else if (r - b > 1.6 * (r - g) + 60 || g < 0.75 * r) ++orange;
      else ++sand;
    }
    const all = data.length / 4;
    return { blue: blue / all, orange: orange / all, sand: sand / all };
  }, png);
}
