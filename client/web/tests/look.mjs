// Takes pictures of the page, built into dist/, with the stand-in for the worker: to be looked at. Usage: node tests/look.mjs [NAME…]
// Each goes to tests/pictures/NAME.png; says what the console said.
import { createServer } from 'node:http';
import { mkdir, readFile } from 'node:fs/promises';
import { extname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { chromium } from 'playwright-core';

const here = fileURLToPath(new URL('.', import.meta.url));
const dist = process.env.INTERVALE_VIEWER_OUT ?? join(here, '../dist');
const kTypes = { '.html': 'text/html; charset=utf-8', '.js': 'text/javascript', '.css': 'text/css', '.svg': 'image/svg+xml', '.wasm': 'application/wasm' };
const kPolicy =
  "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self' ws: wss:; worker-src 'self'; font-src 'self'";
const kDatasets = ['gyroid', 'lost', 'broken', 'full'].map((name) => ({
  name, dims: [49, 49, 49], spacing: [1, 1, 1], origin: [-24, -24, -24], range: [-0.45, 0.75], refine: 'boundary', max_error: 0.61,
  updates: 48000, coefficients: 90000, full: { vertices: 41000, tets: 197000, indexed_bytes: 3.6e6 },
}));

const kPictures = {
  wide: {},
  light: { theme: 'light' },
  phone: { width: 360, height: 740 },
  'phone-open': { width: 360, height: 740, theme: 'light', act: (page) => page.click('#panel-toggle') },
  huge: { width: 3840, height: 2160 },
  clip: { hash: '#data=gyroid&clip=0.8,-0.5,0.3316625,3' },
  'clip-light': { hash: '#data=gyroid&clip=1,0,0,3', theme: 'light' },
  veil: { hash: '#data=gyroid&alpha=3d7fd6,0.35&beta=f0862a,1&box=d8c49a,0.25' },
  'veil-all': { hash: '#data=gyroid&alpha=3d7fd6,0.4&beta=f0862a,0.4&box=d8c49a,0.2', theme: 'light' },
  tets: { hash: '#data=gyroid&roi=-12,-24,-12,24,12,24&show=tets&shrink=0.75' },
  region: { hash: '#data=gyroid&roi=-12,-12,-12,12,12,12' },
  thickness: { hash: '#data=gyroid&show=thickness' },
  'thickness-clip': { hash: '#data=gyroid&show=thickness&clip=1,0,0,3', theme: 'light' },
  wire: { hash: '#data=gyroid&show=wireframe' },
  levels: { hash: '#data=gyroid&show=levels,wireframe' },
  lost: { hash: '#data=lost' },
  broken: { hash: '#data=broken', theme: 'light' },
  help: { act: (page) => page.keyboard.press('h') },
  token: { token: true },
};

const server = createServer(async (request, response) => {
  const path = new URL(request.url, 'http://x').pathname;
  const send = (body, type) => response.writeHead(200, { 'content-type': type, 'content-security-policy': kPolicy }).end(body);
  if (path === '/api/datasets') {
    if (server.asksForToken) return response.writeHead(401).end();
    return send(JSON.stringify({ datasets: kDatasets }), 'application/json');
  }
  try {
    const file = /\/worker-[^/]*\.js$/.test(path) ? join(here, 'fake_worker.js') : join(dist, path === '/' ? 'index.html' : path);
    send(await readFile(file), kTypes[extname(file)] ?? 'application/octet-stream');
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((done) => server.listen(0, '127.0.0.1', done));
const address = `http://127.0.0.1:${server.address().port}/`;
await mkdir(join(here, 'pictures'), { recursive: true });

const browser = await chromium.launch({
  executablePath: process.env.INTERVALE_CHROMIUM ?? '/usr/bin/chromium',
  args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
});
const names = process.argv.length > 2 ? process.argv.slice(2) : Object.keys(kPictures);
for (const name of names) {
  const { width = 1280, height = 800, theme = 'dark', hash = '', act, token } = kPictures[name];
  server.asksForToken = token;
  const page = await browser.newPage({ viewport: { width, height }, colorScheme: theme });
  page.on('console', (message) => console.log(`${name}: ${message.type()}: ${message.text()}`));
  page.on('pageerror', (error) => console.log(`${name}: ${error}`));
  await page.goto(address + hash);
  if (!token && name !== 'broken') {
    await page.waitForFunction((lost) => lost ? window.intervale?.stats.skinVersion > 0 : window.intervale?.progress?.done, hash.includes('lost'), { timeout: 60_000 });
  }
  if (act) await act(page);
  await page.evaluate(() => new Promise((done) => setTimeout(done, 400)));
  await page.screenshot({ path: join(here, 'pictures', `${name}.png`) });
  console.log(name, JSON.stringify(await page.evaluate(() => window.intervale?.stats)));
  await page.close();
}
await browser.close();
server.close();
