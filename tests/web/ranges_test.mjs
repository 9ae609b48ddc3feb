// Several ranges in the viewer, in a real browser, against a real server.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { digestOf, fetched, killServers, launch, makeData, open, progressOf, serve, set, settled, vtkArray } from './support.mjs';

const kAny = { name: 'any', sample: 'buckyball', size: 33 }; // of every range
const kWhole = { min: [-100, -100, -100], max: [100, 100, 100] };
const kSmall = { width: 400, height: 300 };
const kStyle = { color: '#009e73', opacity: 0.5 };

let server;
let browser;
before(async () => {
  server = await serve(makeData(kAny));
  browser = await launch();
});
after(async () => {
  await browser.close();
  killServers();
});

const nativeOf = (...ranges) => fetched(server, kAny.name, ...ranges.flatMap((range) => ['--range', ...range.map(String)]));

test('meshes of several ranges are those of the native client, as they come, change and go', async () => {
  const { page, errors, close } = await open(browser, `${server.url}#data=any&range=128,188&roi=${[...kWhole.min, ...kWhole.max]}`, kSmall);
  await settled(page);
  const show = async (...ranges) => {
    await set(page, ranges.length > 1 ? { ranges: ranges.map((range) => ({ range, style: kStyle })) } : { range: ranges[0], ranges: [] });
    const native = nativeOf(...ranges);
    assert.equal((await digestOf(page)).digest, native.digest, JSON.stringify(ranges));
    const { volumes, tets } = await progressOf(page);
    assert.equal(tets, native.tets);
    const expected = native.ranges?.map(({ volume }) => volume) ?? [native.volume];
    assert.ok(volumes.length === expected.length && volumes.every((volume, i) => Math.abs(volume / expected[i] - 1) < 1e-6), `${volumes} are not ${expected}`);
  };
  await show([128, 188]);
  await show([128, 188], [20, 60]);
  await show([128, 188], [20, 50], [200, 255], [90, 100]);
  await show([200, 255], [90, 100]);
  await show([90, 100]);
  assert.deepEqual(errors, []);
  await close();
});

test('a preview of one range changes that one only; rest makes all of them exact; a saved mesh has all', async () => {
  const hash = `#data=any&range=20,60,e69f00,0.4&range=128,188,009e73,1&roi=${[...kWhole.min, ...kWhole.max]}`;
  const { page, errors, close } = await open(browser, server.url + hash, kSmall);
  await settled(page);
  const first = await progressOf(page);
  await page.evaluate(async () => {
    const answer = window.intervale.next('preview');
    window.intervale.send({ type: 'preview', ranges: [[20, 60], [128, 150]] });
    await answer;
  });
  await page.waitForFunction((volume) => window.intervale.progress.volumes[1] < volume, first.volumes[1]);
  assert.equal((await progressOf(page)).volumes[0], first.volumes[0]);
  await set(page, { ranges: [{ range: [20, 60], style: kStyle }, { range: [128, 150], style: kStyle }] });
  assert.equal((await digestOf(page)).digest, nativeOf([20, 60], [128, 150]).digest);
  const bytes = await page.evaluate(async () => {
    const saved = window.intervale.next('saved');
    window.intervale.send({ type: 'save', format: 'vtu' });
    return [...new Uint8Array((await saved).bytes)];
  });
  const ranges = vtkArray(Buffer.from(bytes), 'range');
  assert.deepEqual([...new Set(ranges)].sort(), [0, 1], 'the cell array names the range of each tetrahedron');
  assert.deepEqual(errors, []);
  await close();
});
