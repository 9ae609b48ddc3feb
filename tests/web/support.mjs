// A server with generated data, a headless browser, and queries of the page in it. The environment, which ctest -L web
// sets: INTERVALE_BIN, the programs' folder; INTERVALE_VIEWER_PAGE, the viewer's folder with its npm packages and
// tests/browser.mjs; INTERVALE_WEB_OUT, where pictures are written.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { createHash } from 'node:crypto';
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import net from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { inflateSync } from 'node:zlib';

import { encode, server as messages } from '../e2e/peers/conversations.mjs';

const kTimeoutMs = 60_000; // for every wait on a page

const need = (name) => process.env[name] ?? assert.fail(`${name} is not set: run these tests by ctest -L web`);
const bin = need('INTERVALE_BIN');
const out = need('INTERVALE_WEB_OUT');
const references = fileURLToPath(new URL('references', import.meta.url));
mkdirSync(out, { recursive: true });
const browser = await import(join(need('INTERVALE_VIEWER_PAGE'), 'tests/browser.mjs'));
export const { decode, difference, eventually, launch, photograph, pixels } = browser;

export const program = (name, ...args) => execFileSync(join(bin, name), args, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'ignore'] });

// A folder with interval volumes, deleted when the tests end. sample: of `intervale sample`, if not the name. range:
// without, the data set has every range.
export function makeData(...wanted) {
  const folder = mkdtempSync(join(tmpdir(), 'intervale-web-'));
  process.on('exit', () => rmSync(folder, { recursive: true, force: true }));
  for (const { name, sample = name, size, range } of wanted) {
    program('intervale', 'sample', sample, '--size', String(size), '-o', join(folder, `${name}.nrrd`));
    program('intervale', 'build', join(folder, `${name}.nrrd`), '-o', join(folder, `${name}.ivm`), ...(range ? ['--range', ...range.map(String)] : []));
  }
  return folder;
}
export const kBuckyball = { name: 'buckyball', size: 65, range: [128, 188] };
export const kBlock = { name: 'block', sample: 'gyroid', size: 9, range: ['-inf', 'inf'] }; // the whole box is inside
export const kGyroid = { name: 'gyroid', size: 33, range: [-0.4, 0.4] };

const servers = new Set();
export const killServers = () => servers.forEach((server) => server.kill('SIGKILL'));

// Starts `intervale serve`. port 0: a free one.
export async function serve(folder, port = 0, ...options) {
  const args = ['serve', folder, '--listen', `127.0.0.1:${port}`, ...options];
  const server = spawn(join(bin, 'intervale'), args, { stdio: ['ignore', 'ignore', 'pipe'] });
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

// A TCP proxy to a local port that carries `bytesPerSecond` of a stream from the server, and everything else at full
// speed. A connection ends when either side closes it. Returns the proxy's port.
export async function throttledProxy(port, bytesPerSecond) {
  const proxy = net.createServer((client) => {
    const server = net.connect(port, '127.0.0.1');
    let timer = null;
    const end = () => {
      clearInterval(timer);
      client.destroy();
      server.destroy();
    };
    for (const socket of [client, server]) socket.on('close', end).on('error', end);
    client.once('data', (request) => {
      server.write(request);
      client.pipe(server);
      if (!request.includes('/v1/stream')) return server.pipe(client);
      let queue = Buffer.alloc(0);
      server.on('data', (data) => {
        queue = Buffer.concat([queue, data]);
        server.pause();
      });
      timer = setInterval(() => {
        client.write(queue.subarray(0, bytesPerSecond / 20));
        queue = queue.subarray(bytesPerSecond / 20);
        if (queue.length === 0) server.resume();
      }, 50);
    });
  });
  await new Promise((resolve) => proxy.listen(0, '127.0.0.1', resolve));
  proxy.unref();
  return proxy.address().port;
}

const frame = (head, bytes) => Buffer.concat([Buffer.from([head, 126, bytes.length >> 8, bytes.length & 255]), bytes]);

// A TCP proxy to a local port that ends each session itself: with Fault, as an answer to the first message, and with its
// code. Returns the proxy's port.
export async function refusingProxy(port, code, text) {
  const proxy = net.createServer((client) => {
    client.on('error', () => client.destroy());
    client.once('data', (request) => {
      if (!request.includes('/v1/stream')) {
        const server = net.connect(port, '127.0.0.1', () => server.write(request));
        server.on('error', () => client.destroy());
        client.pipe(server).pipe(client);
        return;
      }
      const key = /Sec-WebSocket-Key: (\S+)/i.exec(request)[1] + '258EAFA5-E914-47DA-95CA-C5AB0DC85B11';
      const accept = createHash('sha1').update(key).digest('base64');
      client.write('HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n'
        + `Sec-WebSocket-Accept: ${accept}\r\nSec-WebSocket-Protocol: intervale.v1\r\n\r\n`);
      client.once('data', () => {
        client.write(frame(0x82, encode({ 0: messages.Fault, 1: { 0: BigInt(code), 1: text } })));
        client.end(Buffer.from([0x88, 2, code >> 8, code & 255]));
      });
    });
  });
  await new Promise((resolve) => proxy.listen(0, '127.0.0.1', resolve));
  proxy.unref();
  return proxy.address().port;
}

// Opens a page, drawn at half the resolution if no size is given: software rendering takes as long as there are pixels.
// `errors` collects its exceptions and console errors, which include violations of the Content-Security-Policy.
// downloaded(): bytes of files received so far, as transferred.
export async function open(browser, url, { width, height = 600, ...options } = {}) {
  const context = await browser.newContext({ viewport: { width: width ?? 800, height }, deviceScaleFactor: width ? 1 : 0.5, acceptDownloads: true, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(kTimeoutMs);
  const errors = [];
  page.on('console', (message) => {
    if (message.type() === 'error') errors.push(message.text());
  });
  let downloaded = 0; // includes the worker's files
  context.on('response', (response) => {
    if (!response.url().includes('/api/')) downloaded += Number(response.headers()['content-length'] ?? 0);
  });
  page.on('pageerror', (error) => errors.push(String(error)));
  await page.goto(url);
  await page.waitForFunction(() => window.intervale !== undefined);
  return { page, errors, downloaded: () => downloaded, close: () => context.close() };
}

// Waits until the view is completely refined and drawn. A change of the view before reaches the worker with the next
// frame, or when the interval between two views is over; the worker then takes back that it is done.
export async function settled(page) {
  const isDone = () => {
    const { progress, live, stats } = window.intervale;
    return progress?.done && live.connection.state === 'open' && stats.surfaceVersion === progress.surfaceVersion;
  };
  do {
    await page.waitForFunction(isDone);
    await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve, 150))));
    await drawn(page);
  } while (!(await page.evaluate(isDone)));
}

// Waits until the worker has answered all requests, and the picture is drawn.
export async function drawn(page) {
  await digestOf(page); // requests are answered in order
  await page.evaluate(async () => {
    for (let k = 0; k < 3 || !window.intervale.isIdle; ++k) await new Promise((resolve) => requestAnimationFrame(resolve));
  });
}

// The digest of the page's mesh, as the native client's --digest computes it, and its numbers of updates and
// tetrahedra.
export async function digestOf(page) {
  return page.evaluate(async () => {
    const answer = window.intervale.next('digest');
    window.intervale.send({ type: 'digest' });
    return answer;
  });
}

// The same of the native client's mesh, as `intervale-client fetch --json` prints it.
export const fetched = (server, name, ...options) =>
  JSON.parse(program('intervale-client', 'fetch', `ws://${server.address}/${name}`, '--json', '--digest', ...options));

// Changes the view as the controls do, and waits until it is refined.
export async function set(page, change) {
  await page.evaluate((change) => window.intervale.set(change), change);
  await settled(page);
}

export const progressOf = (page) => page.evaluate(() => window.intervale.progress);

// Compares the canvas with references/NAME.png, and writes it to INTERVALE_WEB_OUT. With INTERVALE_WEB_REMAKE=1 it
// replaces the reference first. Returns its pixels.
export async function matches(page, name) {
  const png = await browser.photograph(page);
  const path = join(references, `${name}.png`);
  writeFileSync(join(out, `${name}.png`), Buffer.from(png, 'base64'));
  if (process.env.INTERVALE_WEB_REMAKE) writeFileSync(path, Buffer.from(png, 'base64'));
  assert.ok(existsSync(path), `there is no reference ${path}`);
  const picture = await browser.decode(page, png);
  const { mean, share } = difference(picture, await browser.decode(page, readFileSync(path).toString('base64')), 32);
  assert.ok(mean < 3 && share < 0.02, `${name}: mean difference ${mean.toFixed(2)}; ${(100 * share).toFixed(1)} % of the pixels differ`);
  return picture;
}

// The shares of pixels in the colours of the alpha surface, the beta surface and the interior.
export function surfaceShares(picture) {
  const kind = (r, g, b) => {
    if (Math.max(r, g, b) - Math.min(r, g, b) < 25) return 'none';
    if (b > r + 20) return 'alpha';
    return r - b > 1.6 * (r - g) + 60 || g < 0.75 * r ? 'beta' : 'interior';
  };
  const [alpha, beta, interior] = ['alpha', 'beta', 'interior'].map((name) => browser.share(picture, (r, g, b) => kind(r, g, b) === name));
  return { alpha, beta, interior };
}

// The bytes of an array of a VTK XML file: zlib's blocks behind a table of 64-bit sizes, each in base64 of its own.
export function vtkArray(file, name) {
  const text = file.toString('latin1').match(new RegExp(`Name="${name}"[^>]*>([^<]*)<`))[1];
  const blocks = Number(Buffer.from(text.slice(0, 12), 'base64').readBigUInt64LE());
  const digits = 4 * Math.ceil((8 * (3 + blocks)) / 3);
  const table = Buffer.from(text.slice(0, digits), 'base64');
  const compressed = Buffer.from(text.slice(digits), 'base64');
  let at = 0;
  return Buffer.concat(
    Array.from({ length: blocks }, (_, i) => inflateSync(compressed.subarray(at, (at += Number(table.readBigUInt64LE(8 * (3 + i))))))),
  );
}
