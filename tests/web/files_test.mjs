// Files that are shown by the page itself, in a real browser: their meshes are those of a server, which the page's own has
// never seen.
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { extname, join, normalize } from 'node:path';
import { after, before, test } from 'node:test';

import { digestOf, fetched, kBlock, kGyroid, killServers, launch, makeData, matches, open, progressOf, serve, set, settled } from './support.mjs';

const kAny = { name: 'any', sample: 'buckyball', size: 33 }; // of every range
const kLarge = { name: 'large', sample: 'buckyball', size: 129 }; // of every range, in several pages
const kWhole = { min: [-100, -100, -100], max: [100, 100, 100] };
const kSmall = { width: 900, height: 600 };
const kStyle = { color: '#009e73', opacity: 1 };

let server; // of the page
let peer; // of the files
let folder; // of the files
let browser;
before(async () => {
  server = await serve(makeData(kBlock));
  folder = makeData(kAny, kGyroid, kLarge);
  peer = await serve(folder);
  browser = await launch();
});
after(async () => {
  await browser.close();
  killServers();
});

const pathOf = (name) => join(folder, `${name}.ivm`);
const nativeOf = (name, ...ranges) => fetched(peer, name, ...ranges.flatMap((range) => ['--range', ...range.map(String)]));

// Chooses a file, as the button's dialog does, and waits until it is shown.
async function choose(page, path, name) {
  await page.setInputFiles('#file', path);
  await page.waitForFunction((name) => window.intervale.live.dataset?.name === name, name);
  await settled(page);
}

async function drop(page, name, bytes) {
  const transfer = await page.evaluateHandle(([name, base64]) => {
    const transfer = new DataTransfer();
    transfer.items.add(new File([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], name));
    return transfer;
  }, [name, bytes.toString('base64')]);
  await page.dispatchEvent('#stage', 'dragenter', { dataTransfer: transfer });
  assert.ok(await page.isVisible('#drop'), 'says where to drop it');
  await page.dispatchEvent('#stage', 'drop', { dataTransfer: transfer });
  assert.ok(!(await page.isVisible('#drop')));
}

const bannerOf = async (page, text) => {
  await page.waitForFunction((text) => !document.getElementById('banner').hidden && document.getElementById('banner-text').textContent.includes(text), text);
  return page.textContent('#banner-text');
};

test('a file is shown in any range, beside the data sets of the server, and without it', async () => {
  const { page, errors, close } = await open(browser, server.url, kSmall);
  await settled(page);
  const block = await digestOf(page);
  await page.evaluate(() => {
    window.failures = [];
    void window.intervale.next('error').then(({ text }) => window.failures.push(text));
  });
  await choose(page, pathOf('any'), 'any');
  assert.ok(await page.isVisible('#histogram'), 'its statistics are shown');
  await set(page, { region: kWhole });
  for (const ranges of [[[128, 188]], [[20, 60]], [[128, 188], [20, 50], [200, 255]], [[90, 100]]]) {
    await set(page, ranges.length > 1 ? { ranges: ranges.map((range) => ({ range, style: kStyle })) } : { range: ranges[0], ranges: [] });
    assert.equal((await digestOf(page)).digest, nativeOf('any', ...ranges).digest, JSON.stringify(ranges));
  }
  await page.click('.dataset:has-text("block")');
  await page.waitForFunction(() => window.intervale.live.dataset?.name === 'block');
  await settled(page);
  assert.equal((await digestOf(page)).digest, block.digest, 'the server\'s data set is back');
  await page.click('.dataset:has-text("any")');
  await page.waitForFunction(() => window.intervale.live.dataset?.name === 'any');
  await settled(page);
  await set(page, { range: [128, 188], region: null, pixelError: 0.5 });
  await matches(page, 'files-any');
  assert.equal((await progressOf(page)).reconnects, 0);
  assert.deepEqual(await page.evaluate(() => window.failures), [], 'views are for the data set that is open');
  assert.deepEqual(errors, []);
  await close();
});

// The page and the files on a server that knows neither, and lets pages of every origin read them. Returns its address.
async function serveFolders() {
  const types = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.svg': 'image/svg+xml', '.wasm': 'application/wasm' };
  const files = createServer((request, response) => {
    const path = normalize(decodeURIComponent(new URL(request.url, 'http://x').pathname));
    try {
      const body = readFileSync(path.startsWith('/data/') ? join(folder, path.slice(6)) : join(process.env.INTERVALE_VIEWER_OUT, path));
      const type = types[extname(path)] ?? 'application/octet-stream';
      response.writeHead(200, { 'content-type': type, 'access-control-allow-origin': '*' }).end(body);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((resolve) => files.listen(0, '127.0.0.1', resolve));
  files.unref();
  return `http://127.0.0.1:${files.address().port}`;
}

test('a plain web server is enough: the address names the file, and the view of it', async () => {
  const address = await serveFolders();
  const { page, errors, close } = await open(browser, `${address}/index.html?file=data/any.ivm#data=any&range=20,60&roi=${[...kWhole.min, ...kWhole.max]}`, kSmall);
  await settled(page);
  assert.equal((await digestOf(page)).digest, nativeOf('any', [20, 60]).digest);
  await set(page, { range: [128, 188] });
  await page.waitForFunction(() => location.search === '?file=data/any.ivm' && location.hash.includes('range=128,188'));
  assert.deepEqual(errors, []);
  await page.goto(`${address}/index.html?file=data/none.ivm`);
  assert.match(await bannerOf(page, 'status 404'), /was not received: the server responded with status 404/);
  await choose(page, pathOf('gyroid'), 'gyroid');
  await close();
});

// Files in ranges, as web servers send them. gate: awaited before a range of more than half of a file is sent; if it is
// false, there is no such file then.
async function serveRanges(gate) {
  const requests = [];
  const files = createServer(async (request, response) => {
    const headers = { 'access-control-allow-origin': '*', 'content-type': 'application/octet-stream' };
    if (request.method === 'OPTIONS') return response.writeHead(204, { ...headers, 'access-control-allow-headers': 'Range' }).end();
    const bytes = readFileSync(join(folder, normalize(decodeURIComponent(new URL(request.url, 'http://x').pathname))));
    const [, first, last] = /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? '') ?? [];
    if (first === undefined) return response.writeHead(200, headers).end(bytes);
    const part = bytes.subarray(Number(first), Number(last) + 1);
    if (part.length > bytes.length / 2 && (await gate) === false) return response.writeHead(404, headers).end();
    requests.push(part.length);
    return response.writeHead(206, { ...headers, 'content-range': `bytes ${first}-${Number(first) + part.length - 1}/${bytes.length}` }).end(part);
  });
  await new Promise((resolve) => files.listen(0, '127.0.0.1', resolve));
  files.unref();
  return { address: `http://127.0.0.1:${files.address().port}`, requests };
}

test('a file that is on its way is shown already, as coarse as need be, and ends as the whole file', async () => {
  let goOn;
  const { address, requests } = await serveRanges(new Promise((resolve) => (goOn = resolve)));
  const size = readFileSync(pathOf('large')).length;
  const mine = await serve(folder, 0, '--connect-origin', address);
  const { page, errors, close } = await open(browser, `${mine.url}?file=${address}/large.ivm#data=large&range=100,180`, kSmall);
  await page.waitForFunction(() => window.intervale.live.progress?.tets > 1000);
  assert.match(await page.textContent('#banner-text'), /^Receiving large\.ivm: /);
  const { done, updates } = await progressOf(page);
  const received = requests.reduce((sum, bytes) => sum + bytes, 0);
  assert.ok(!done && received < size / 2, `${received} of ${size} bytes`);
  goOn();
  await settled(page);
  assert.ok(await page.isHidden('#banner'), 'all was received');
  assert.ok((await progressOf(page)).updates > updates);
  await set(page, { region: kWhole });
  assert.equal((await digestOf(page)).digest, nativeOf('large', [100, 180]).digest);
  assert.equal(requests.reduce((sum, bytes) => sum + bytes, 0), size, 'nothing is received twice');
  assert.deepEqual(errors, []);
  await close();
  await mine.kill();
});

test('a file that is lost on its way is told of, and what has arrived stays', async () => {
  const { address } = await serveRanges(Promise.resolve(false));
  const mine = await serve(folder, 0, '--connect-origin', address);
  const { page, errors, close } = await open(browser, `${mine.url}?file=${address}/large.ivm#data=large&range=100,180`, kSmall);
  assert.match(await bannerOf(page, 'its server responded with status 404'), /^Only coarse scales are shown: large\.ivm: /);
  await settled(page);
  assert.ok((await progressOf(page)).triangles > 100);
  await set(page, { region: kWhole });
  await settled(page);
  assert.deepEqual(errors.filter((error) => !/404/.test(error)), []);
  await close();
  await mine.kill();
});

test('the served page shows files of the origins that --connect-origin names, and of no other', async () => {
  const address = await serveFolders();
  const query = `?file=${address}/data/any.ivm#data=any&range=20,60&roi=${[...kWhole.min, ...kWhole.max]}`;
  const mine = await serve(folder, 0, '--connect-origin', address);
  const allowed = await open(browser, mine.url + query, kSmall);
  await settled(allowed.page);
  const { digest, tets } = await digestOf(allowed.page);
  const native = nativeOf('any', [20, 60]);
  assert.deepEqual([digest, tets], [native.digest, native.tets]);
  assert.deepEqual(allowed.errors, []);
  await allowed.close();
  await mine.kill();
  const other = await serveRanges();
  const refused = await open(browser, `${server.url}?file=${other.address}/any.ivm`, kSmall);
  assert.match(await bannerOf(refused.page, 'cannot be reached'), /cannot be reached, or this page may not read it: .*--connect-origin/);
  assert.deepEqual(other.requests, [], 'nothing is asked of it');
  await refused.close();
});

test('a dropped file goes on when the server is gone; budgets and cameras are obeyed', async () => {
  const mine = await serve(makeData(kBlock));
  const { page, close } = await open(browser, mine.url, kSmall);
  await settled(page);
  await drop(page, 'gyroid.ivm', readFileSync(pathOf('gyroid')));
  await page.waitForFunction(() => window.intervale.live.dataset?.name === 'gyroid');
  await settled(page);
  await mine.kill();
  await set(page, { region: kWhole });
  assert.equal((await digestOf(page)).digest, nativeOf('gyroid').digest);
  const all = await progressOf(page);
  await set(page, { region: null, pixelError: 8 });
  await set(page, { memory: 1e-3 * 30 }); // 1,000 updates
  const few = await progressOf(page);
  assert.ok(few.updates <= 1000 && few.updates > 500 && few.updates < all.updates, `${few.updates} updates`);
  await close();
});

test('what is no such file is refused in one line, and what is shown stays', async () => {
  const { page, errors, close } = await open(browser, server.url, kSmall);
  await settled(page);
  const before = await digestOf(page);
  const good = readFileSync(pathOf('any'));
  const changed = Buffer.from(good);
  changed[good.length >> 1] ^= 1;
  for (const [name, bytes, text] of [
    ['notes.txt', Buffer.from('This is not a data set.'), 'notes.txt: '],
    ['empty.ivm', Buffer.alloc(0), 'empty.ivm: '],
    ['cut.ivm', good.subarray(0, good.length >> 1), 'cut.ivm: '],
    ['changed.ivm', changed, 'changed.ivm: '],
  ]) {
    const path = join(folder, name);
    writeFileSync(path, bytes);
    await page.setInputFiles('#file', path);
    const line = await bannerOf(page, text);
    assert.ok(line.length < 200 && !line.includes('\n'), line);
    assert.equal((await digestOf(page)).digest, before.digest);
    await page.click('#dismiss');
  }
  await choose(page, pathOf('any'), 'any');
  assert.ok(!(await page.isVisible('#banner')), 'the error is gone');
  assert.deepEqual(errors, []);
  await close();
});
