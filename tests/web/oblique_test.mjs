// Grids whose axes are not the world's, in the viewer.
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { difference, digestOf, eventually, fetched, kBuckyball, killServers, launch, makeData, open, pixels, program, serve, settled } from './support.mjs';

let server;
let browser;

// The same field: samples in the order of descending x, and a grid whose first axis points to -x.
function addMirrored(folder) {
  const file = readFileSync(join(folder, 'buckyball.nrrd'));
  const start = file.indexOf('\n\n') + 2;
  const header = file.subarray(0, start).toString('latin1');
  const spacing = Number(header.match(/space directions: \(([^,]*),/)[1]);
  const side = kBuckyball.size;
  const samples = new Float32Array(file.buffer.slice(file.byteOffset + start, file.byteOffset + file.length));
  for (let row = 0; row < samples.length; row += side) samples.subarray(row, row + side).reverse();
  const mirrored = header
    .replace(`directions: (${spacing},`, `directions: (${-spacing},`)
    .replace('space origin: (-1,', 'space origin: (1,')
    .replace('\n\n', '\nspace units: "mm" "mm" "mm"\ncontent: density\n\n');
  writeFileSync(join(folder, 'mirrored.nrrd'), Buffer.concat([Buffer.from(mirrored, 'latin1'), Buffer.from(samples.buffer)]));
  program('intervale', 'build', join(folder, 'mirrored.nrrd'), '-o', join(folder, 'mirrored.ivm'), '--range', ...kBuckyball.range.map(String));
}

before(async () => {
  const data = makeData(kBuckyball);
  addMirrored(data);
  server = await serve(data);
  browser = await launch();
});
after(async () => {
  await browser.close();
  killServers();
});

const kCamera = 'eye=2.6,-3.2,2.2&at=0,0,0&up=0,0,1&px=0.5';

test('a mirrored grid of mirrored samples is the same picture', async () => {
  for (const more of ['', '&clip=0.8,0.6,0,0.1', '&show=thickness', '&alpha=3d7fd6,0.5&beta=f0862a,0.5']) {
    const pictures = [];
    for (const name of ['buckyball', 'mirrored']) {
      const { page, errors, close } = await open(browser, `${server.url}#data=${name}&${kCamera}${more}`);
      await settled(page);
      pictures.push(await pixels(page));
      if (name === 'mirrored') await eventually(async () => assert.match(await page.textContent('#status-values'), /mm³/));
      if (name === 'mirrored') await eventually(async () => assert.equal(await page.textContent('#alpha-value'), 'density = 128'));
      assert.deepEqual(errors, []);
      await close();
    }
    const { mean, share } = difference(...pictures, 32);
    assert.ok(mean < 3 && share < 0.02, `${more}: mean difference ${mean.toFixed(2)}; ${(100 * share).toFixed(1)} % of the pixels differ`);
  }
});

test('a mirrored grid has the mesh of the native client', async () => {
  const { page, close } = await open(browser, `${server.url}#data=mirrored&${kCamera}&roi=-9,-9,-9,9,9,9`);
  await settled(page);
  assert.equal((await digestOf(page)).digest, fetched(server, 'mirrored').digest);
  await close();
});
