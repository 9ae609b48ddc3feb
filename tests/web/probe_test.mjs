// The viewer's probe of a known field, in a real browser, against a real server.
import assert from 'node:assert/strict';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { eventually, killServers, launch, makeData, open, program, serve, settled } from './support.mjs';

const kSide = 9;
const kSpacing = 0.5;
const kRegion = '-30,-30,-30,90,90,90'; // everything, with its handles beyond the window
const seed = Number(process.env.INTERVALE_SEED ?? Date.now() % 1e6);
let last = seed;
const noise = (count) => Uint16Array.from({ length: count }, () => {
  last = (last * 1103515245 + 12345) % 2147483648;
  return last >> 15;
});
const samples = noise(kSide ** 3);
const heat = noise(kSide ** 3); // a channel
const valueAt = (i, j, k, of = samples) => of[i + kSide * (j + kSide * k)];

let server;
let browser;
before(async () => {
  console.log(`seed ${seed} (INTERVALE_SEED)`);
  const folder = makeData();
  const header = `NRRD0004\ntype: uint16\ndimension: 3\nsizes: ${kSide} ${kSide} ${kSide}\nspacings: ${kSpacing} ${kSpacing} ${kSpacing}\nendian: little\n`;
  const write = (name, lines, values) => writeFileSync(join(folder, name), Buffer.concat([Buffer.from(`${header}${lines}encoding: raw\n\n`), Buffer.from(values.buffer)]));
  write('digits.nrrd', '', samples);
  write('heat.nrrd', 'sample units: K\n', heat);
  const whole = ['--range', '-inf', 'inf', '--refine', 'uniform']; // every sample is a vertex of the mesh
  program('intervale', 'build', join(folder, 'digits.nrrd'), '-o', join(folder, 'digits.ivm'), ...whole, '--channel', `heat=${join(folder, 'heat.nrrd')}`, '--unit', 'mm', '--field', 'density', '--field-unit', 'HU');
  server = await serve(folder);
  browser = await launch();
});
after(async () => {
  await browser.close();
  killServers();
});

const sizeOf = (page) => page.evaluate(() => [window.intervale.canvas.clientWidth, window.intervale.canvas.clientHeight]);

// Looks at a sample of the side y = 0 straight ahead, so that the canvas's middle pixel has it in its centre; with this
// clip plane. Ends when the probe tells there what is expected: the value, those of the others, and the position.
async function tells(page, i, j, k, clip, expected) {
  await page.evaluate(([x, y, z, plane]) => {
    window.intervale.set({ clip: plane, pose: { eye: [x, y - 20, z], lookAt: [x, y, z], up: [0, 0, 1], fov: 30 } });
  }, [i * kSpacing, j * kSpacing, k * kSpacing, clip]);
  await settled(page);
  const { x, y } = await page.locator('#canvas').boundingBox();
  const [width, height] = await sizeOf(page);
  assert.ok(width % 2 === 1 && height % 2 === 1, `there is a middle pixel: ${width} x ${height}`);
  await page.mouse.move(x + width / 2 + 3, y + height / 2);
  await page.mouse.move(x + (width - 1) / 2 + 0.5, y + (height - 1) / 2 + 0.5);
  const told = () => page.$$eval('#probe-label *', (parts) => parts.map((part) => part.textContent));
  await eventually(async () => assert.deepEqual(await told(), expected, `sample ${i}, ${j}, ${k}`));
}

test('at a sample the probe tells its value exactly, on the side of the box and on a cut', async () => {
  const { page, errors, close } = await open(browser, `${server.url}#data=digits&show=probe&roi=${kRegion}`, { width: 401, height: 340 });
  await settled(page);
  if ((await sizeOf(page))[1] % 2 === 0) await page.setViewportSize({ width: 401, height: 341 });
  const density = (...at) => `density = ${valueAt(...at)} HU`, hot = (...at) => `heat = ${valueAt(...at, heat)} K`;
  const position = (...at) => `${at.map((index) => index * kSpacing).join(', ')} mm`;
  for (const [i, k] of [[1, 1], [4, 6], [7, 3]]) await tells(page, i, 0, k, null, [density(i, 0, k), hot(i, 0, k), position(i, 0, k)]);
  const at = [5, 4, 2];
  const cut = { normal: [0, -1, 0], offset: -at[1] * kSpacing };
  await tells(page, ...at, cut, [density(...at), hot(...at), position(...at)]);
  await page.evaluate(() => window.intervale.set({ colorBy: 'value', channel: 'heat' }));
  await page.waitForFunction(() => document.querySelector('#legend-title').textContent === 'heat, K');
  await tells(page, ...at, cut, [hot(...at), density(...at), position(...at)]);
  assert.deepEqual(errors, []);
  await close();
});
