// The npm package, installed into an empty project, built there with Vite, and shown in a real browser. The
// environment: INTERVALE_PACKAGE, the packed package; see support.mjs for the rest.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { cpSync, mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync, statSync, symlinkSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { tmpdir } from 'node:os';
import { extname, join, normalize } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';

import { decode, eventually, fetched, killServers, launch, makeData, serve } from './support.mjs';

const kAny = { name: 'any', sample: 'buckyball', size: 33 }; // of every range
const kOne = { name: 'one', sample: 'gyroid', size: 17, range: [0, 0.6] };
const kRanges = [[128, 188]];
const kMimeTypes = { '.html': 'text/html; charset=utf-8', '.js': 'text/javascript', '.wasm': 'application/wasm' };
const kPolicy = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
  + "connect-src 'self' http: ws:; worker-src 'self'";

const project = mkdtempSync(join(tmpdir(), 'intervale-project-'));
let server;
let files; // of the built project
let browser;
let page;
const errors = [];

const address = (name) => `ws://${server.address}/${name}`;
const run = (program, ...args) => {
  try {
    return execFileSync(program, args, { cwd: project, encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] });
  } catch (error) {
    assert.fail(`${program} ${args.join(' ')}: ${error.stdout}${error.stderr}`);
  }
};

// The packages that the project has besides come from where the viewer's are: nothing is fetched.
function build() {
  writeFileSync(join(project, 'package.json'), JSON.stringify({ name: 'project', private: true, type: 'module' }));
  run('npm', 'install', '--offline', '--no-audit', '--no-fund', '--ignore-scripts', process.env.INTERVALE_PACKAGE);
  assert.deepEqual(readdirSync(join(project, 'node_modules')).filter((name) => !name.startsWith('.')), ['@intervale'], 'it needs no others');
  assert.ok(statSync(process.env.INTERVALE_PACKAGE).size < 600_000); // two modules, of which one is loaded for files only
  const packages = join(process.env.INTERVALE_VIEWER_PAGE, 'node_modules');
  mkdirSync(join(project, 'node_modules/@types'), { recursive: true });
  for (const name of ['three', 'vite', 'typescript', '@types/three']) symlinkSync(join(packages, name), join(project, 'node_modules', name));
  cpSync(fileURLToPath(new URL('consumer', import.meta.url)), project, { recursive: true });
  const options = { target: 'ES2022', module: 'ESNext', moduleResolution: 'bundler', strict: true, noEmit: true, skipLibCheck: false, lib: ['ES2022', 'DOM', 'DOM.Iterable'], types: [] };
  writeFileSync(join(project, 'tsconfig.json'), JSON.stringify({ compilerOptions: { ...options, preserveSymlinks: true, skipLibCheck: true }, files: ['main.ts'] }));
  run(process.execPath, join(packages, 'typescript/bin/tsc'), '-p', '.');
  run(process.execPath, join(packages, 'vite/bin/vite.js'), 'build', '--logLevel', 'error');
}

async function serveFiles() {
  const made = createServer((request, response) => {
    const path = normalize(new URL(request.url, 'http://x').pathname);
    try {
      const body = readFileSync(join(project, 'dist', path === '/' ? 'index.html' : path));
      response.writeHead(200, { 'content-type': kMimeTypes[extname(path)] ?? 'text/html', 'content-security-policy': kPolicy }).end(body);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((resolve) => made.listen(0, '127.0.0.1', resolve));
  return made;
}

before(async () => {
  build();
  files = await serveFiles();
  const origin = `http://127.0.0.1:${files.address().port}`;
  const folder = makeData(kAny, kOne);
  cpSync(join(folder, 'any.ivm'), join(project, 'dist/any.ivm'));
  server = await serve(folder, 0, '--allow-origin', origin);
  browser = await launch();
  page = await browser.newPage({ viewport: { width: 400, height: 600 } });
  page.setDefaultTimeout(60_000);
  page.on('console', (message) => message.type() === 'error' && errors.push(message.text()));
  page.on('pageerror', (error) => errors.push(String(error)));
  await page.goto(`${origin}/`);
  await page.waitForFunction(() => window.consumer !== undefined);
});
after(async () => {
  await browser?.close();
  files?.close();
  killServers();
  rmSync(project, { recursive: true, force: true });
});

test('arrays are those of the mesh, of each range', async () => {
  const shown = async (ranges) => page.evaluate(async ([address, ranges]) => {
    const ended = window.arrays?.ended();
    if (window.arrays) window.arrays.setRanges(ranges);
    else {
      window.arrays = await window.consumer.arrays(address, ranges);
      await window.arrays.ended();
    }
    await ended;
    return window.arrays.shown();
  }, [address('any'), ranges]);
  for (const ranges of [kRanges, [[20, 60]], [[128, 188], [20, 60]]]) {
    const found = await shown(ranges);
    const native = fetched(server, 'any', ...ranges.flatMap((range) => ['--range', ...range.map(String)]));
    assert.equal(found.digest, native.digest);
    assert.equal(found.file, 84 + 50 * found.triangles);
    assert.ok(Math.abs(found.volume / native.volume - 1) < 1e-4, `${found.volume} is not ${native.volume}`);
    assert.equal(found.levels >= 0, true);
  }
  const { events } = await page.evaluate(() => window.arrays.shown());
  assert.deepEqual(events, ['load-start', 'load-end', 'load-start', 'load-end', 'load-start', 'load-end']);
});

test('a file is a data set without a server, for several meshes at once', async () => {
  const [first, second] = await page.evaluate(async (ranges) => {
    const meshes = await window.consumer.fileArrays('any.ivm', ranges, [[20, 60]]);
    await Promise.all(meshes.map((arrays) => arrays.ended()));
    return Promise.all(meshes.map((arrays) => arrays.shown()));
  }, kRanges);
  assert.equal(first.digest, fetched(server, 'any', '--range', '128', '188').digest);
  assert.equal(second.digest, fetched(server, 'any', '--range', '20', '60').digest);
  assert.match(await page.evaluate(() => window.consumer.refusal('no data set')), /^text\.ivm: [^\n]+$/);
});

// Of an element, which is kept as NAME.png, too.
async function pictureOf(selector, name) {
  const png = await page.locator(selector).screenshot();
  if (name) writeFileSync(join(process.env.INTERVALE_WEB_OUT, `${name}.png`), png);
  return decode(page, png.toString('base64'));
}
const colored = ({ data }, predicate) => {
  let n = 0;
  for (let i = 0; i < data.length; i += 4) if (predicate(data[i], data[i + 1], data[i + 2])) ++n;
  return (4 * n) / data.length;
};
const saturation = (r, g, b) => Math.max(r, g, b) - Math.min(r, g, b);

test("an object of three.js refines for its camera, has the field's colours, is hit by rays, and ends", async () => {
  // The surface of what has come follows with a frame. Returns what is shown once it has about the volume of a range.
  const shows = (...range) => {
    const { volume } = fetched(server, 'any', '--range', ...range);
    return eventually(async () => {
      const shown = await page.evaluate(() => window.three.shown());
      assert.ok(Math.abs(shown.volume / volume - 1) < 0.05, `${shown.volume} is not about ${volume}`);
      return shown;
    });
  };
  await page.evaluate(async ([address, ranges]) => {
    window.three = window.consumer.three(address, ranges);
    await window.three.ended();
  }, [address('any'), kRanges]);
  const shown = await shows('128', '188');
  assert.deepEqual(shown.events, ['load-start', 'load-end']);
  assert.ok(shown.version > 0);
  assert.ok(shown.distance > 5 && shown.distance < 15, `${shown.distance}`);
  assert.ok(colored(await pictureOf('#three', 'package-three'), (r, g, b) => saturation(r, g, b) > 40) > 0.1);
  await page.evaluate(async () => {
    const ended = window.three.ended();
    window.three.volume.setRange(20, 60);
    await ended;
  });
  await shows('20', '60');
  await page.evaluate(() => window.three.dispose());
});

test('an element shows its data set, follows its attributes and the mouse, and tells what it does', async () => {
  await page.evaluate((src) => {
    window.events = [];
    const view = document.createElement('intervale-view');
    for (const type of ['load-start', 'load-end', 'load-error']) view.addEventListener(type, ({ detail }) => window.events.push(detail ? `${type}: ${detail.message}` : type));
    view.setAttribute('range', '128 188');
    view.setAttribute('src', src);
    document.querySelector('#views').append(view);
  }, address('any'));
  const ended = (times) => page.waitForFunction((times) => window.events.filter((type) => type === 'load-end').length >= times, times);
  await ended(1);
  const blue = (picture) => colored(picture, (r, g, b) => b > r + 30);
  const orange = (picture) => colored(picture, (r, g, b) => r > b + 30);
  let first;
  await eventually(async () => {
    first = await pictureOf('intervale-view', 'package-element');
    assert.ok(blue(first) + orange(first) > 0.1, `${blue(first)} ${orange(first)}`);
  });
  await page.mouse.move(200, 150);
  await page.mouse.down();
  await page.mouse.move(260, 150);
  await page.mouse.up();
  await eventually(async () => assert.notDeepEqual((await pictureOf('intervale-view')).data, first.data));
  await page.evaluate(() => document.querySelector('intervale-view').setAttribute('color-by', 'value'));
  await eventually(async () => assert.ok(blue(await pictureOf('intervale-view')) < blue(first) / 2 || orange(await pictureOf('intervale-view')) < orange(first) / 2));
  await page.evaluate((src) => document.querySelector('intervale-view').setAttribute('src', src), address('one'));
  await eventually(() => page.evaluate(() => { if (document.querySelector('intervale-view').volume.dataset?.name !== 'one') throw new Error('not yet'); }));
  assert.ok(!(await page.evaluate(() => window.events)).some((event) => event.startsWith('load-error')));
  await page.evaluate((src) => document.querySelector('intervale-view').setAttribute('src', src), address('nothing'));
  await eventually(async () => assert.match((await page.evaluate(() => window.events)).at(-1), /^load-error: The server has no data set/));
  // Taken out and put in again, in the middle of an error.
  await page.evaluate((src) => {
    window.events = [];
    const view = document.querySelector('intervale-view');
    view.remove();
    view.setAttribute('src', src);
    document.querySelector('#views').append(view);
  }, address('any'));
  await ended(1);
  await eventually(async () => assert.ok(colored(await pictureOf('intervale-view'), (r, g, b) => saturation(r, g, b) > 30) > 0.1));
  assert.deepEqual(await page.evaluate(() => window.events), ['load-start', 'load-end']);
  await page.evaluate(() => document.querySelector('intervale-view').remove());
  assert.deepEqual(errors, []);
});

// Pictures follow each other no faster than the screen, whose rate is below 240 a second.
test('an element draws a coarser mesh while its camera moves, if there is a frame rate, and all of it at rest', async () => {
  await page.evaluate((src) => {
    window.events = [];
    const view = document.createElement('intervale-view');
    view.addEventListener('load-end', () => window.events.push('load-end'));
    view.setAttribute('range', '128 188');
    view.setAttribute('frame-rate', '0');
    view.setAttribute('src', src);
    document.querySelector('#views').append(view);
  }, address('any'));
  await page.waitForFunction(() => window.events.length > 0);
  // How many of the pictures of a move have the coarser mesh.
  const coarse = () => page.evaluate(async () => {
    const view = document.querySelector('intervale-view');
    const { pose } = view;
    let count = 0;
    for (let i = 0; i < 90; ++i) {
      view.setPose({ ...pose, eye: pose.eye.map((x, axis) => x + (axis === 0 ? i / 100 : 0)) });
      await new Promise((resolve) => requestAnimationFrame(resolve));
      count += view.volume.isCoarse ? 1 : 0;
    }
    return count;
  });
  assert.equal(await coarse(), 0);
  await page.evaluate(() => document.querySelector('intervale-view').setAttribute('frame-rate', '240'));
  await eventually(async () => assert.ok((await coarse()) > 0));
  await page.waitForFunction(() => !document.querySelector('intervale-view').volume.isCoarse);
  await page.evaluate(() => document.querySelector('intervale-view').remove());
  assert.deepEqual(errors, []);
});
