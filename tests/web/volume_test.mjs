// The viewer's volume rendering, in a real browser, against a real server: its pictures are those of the native program.
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { decode, difference, killServers, launch, makeData, open, photograph, program, serve, set, settled } from './support.mjs';

let folder;
let server;
let browser;
before(async () => {
  folder = makeData({ name: 'gyroid', size: 9 });
  server = await serve(folder);
  browser = await launch();
});
after(async () => {
  await browser.close();
  killServers();
});

// The part that the volume covers: beside it pictures have other backgrounds, and the native one a colour bar.
function middle({ width, height, data }) {
  const side = Math.floor(height / 2);
  const row = (i) => 4 * ((Math.floor(height / 4) + i) * width + Math.floor((width - side) / 2));
  return { width: side, height: side, data: Buffer.concat(Array.from({ length: side }, (_, i) => data.subarray(row(i), row(i) + 4 * side))) };
}

// How much the page's picture and the native one of the same view differ.
async function compared(page, name, ...options) {
  const { pose } = await page.evaluate(() => window.intervale.state);
  const png = await photograph(page);
  const picture = await decode(page, png);
  const path = join(process.env.INTERVALE_WEB_OUT, `volume-${name}-native.png`);
  const camera = [['eye', pose.eye], ['look-at', pose.lookAt], ['up', pose.up]].flatMap(([key, at]) => [`--${key}`, ...at.map(String)]);
  const screen = ['--fov', String(pose.fov), '--pixel-error', '0.1', '--viewport', `${picture.width}`, `${picture.height}`];
  program('intervale', 'extract', join(folder, 'gyroid.ivm'), '--render', 'volume', '--image', path, ...camera, ...screen, ...options);
  writeFileSync(join(process.env.INTERVALE_WEB_OUT, `volume-${name}.png`), Buffer.from(png, 'base64'));
  const expected = await decode(page, readFileSync(path).toString('base64'));
  return difference(middle(picture), middle(expected), 24);
}

test('pictures are those of the native program', async () => {
  const look = ['--range', '-0.5', '1', '--opacity', '-0.5:0.3,0.2:0.05,1:0.5', '--palette', 'inferno'];
  const camera = 'eye=2.2,-3.1,1.9&at=0,0,0&up=0,0,1';
  const hash = `data=gyroid&${camera}&px=0.1&range=-0.5,1&render=volume&opacity=-0.5:0.3,0.2:0.05,1:0.5&palette=inferno`;
  const { page, errors, close } = await open(browser, `${server.url}#${hash}`, { width: 360, height: 260, colorScheme: 'light' });
  await settled(page);
  const near = async (name, ...options) => {
    const { mean, share } = await compared(page, name, ...look, ...options);
    console.log(`${name}: mean difference ${mean}, other ${share}`);
    assert.ok(mean < 2.5 && share < 0.01, `${name}: mean difference ${mean}, other ${share}`);
  };
  await near('all');
  await set(page, { clip: { normal: [0.6, -0.8, 0], offset: 0.15 } });
  await near('cut', '--clip', '0.09', '-0.12', '0', '0.6', '-0.8', '0');
  // From inside, where the eye is in a tetrahedron
  await set(page, { clip: null, pose: { eye: [0.1, 0.2, -0.15], lookAt: [-1, 0.6, 0.3], up: [0, 0, 1], fov: 60 } });
  await near('inside');
  assert.deepEqual(errors, []);
  await close();
});
