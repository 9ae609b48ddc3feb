// What a moving camera and a region show, in a real browser, against a real server.
import assert from 'node:assert/strict';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { digestOf, drawn, fetched, kBuckyball, killServers, launch, makeData, open, progressOf, serve, set, settled } from './support.mjs';

const kCamera = 'eye=2.6,-3.2,2.2&at=0,0,0&up=0,0,1';
const kRegion = { min: [0, -1, -1], max: [1, 1, 1] };

let server;
let browser;
before(async () => {
  server = await serve(makeData(kBuckyball));
  browser = await launch();
});
after(async () => {
  await browser.close();
  killServers();
});

test('a region that is switched on later shows the mesh of a client that asked for it only; then all is there again', async () => {
  const { page, errors, close } = await open(browser, `${server.url}#data=buckyball&${kCamera}&px=0.5`, { width: 500, height: 400 });
  await settled(page);
  const fine = await digestOf(page);
  await set(page, { region: kRegion });
  const { bytes } = await progressOf(page);
  assert.equal((await digestOf(page)).digest, fetched(server, 'buckyball', '--roi', '0', '-1', '-1', '1', '1', '1').digest);
  await set(page, { region: null });
  assert.ok((await digestOf(page)).tets >= fine.tets);
  const progress = await progressOf(page);
  assert.ok(progress.bytes - bytes < 1000, 'it is not sent again');
  assert.equal(progress.repeated, 0);
  assert.deepEqual(errors, []);
  await close();
});

// A software renderer takes longer than 1/240 s for any picture.
for (const [name, hash] of [['surfaces', ''], ['wireframe', 'show=wireframe'], ['values', 'color=value'], ['a cut', 'clip=1,0,0,0'], ['thickness', 'show=thickness']]) {
  test(`${name} of a moving camera are those of a coarser mesh`, async () => {
    const { page, errors, close } = await open(browser, `${server.url}#data=buckyball&${kCamera}&px=0.5&fps=240&${hash}`, { width: 500, height: 400 });
    await settled(page);
    await drawn(page);
    await page.evaluate(async () => {
      const { pose } = window.intervale.state;
      for (let i = 0; i < 40 || (window.intervale.stats.coarseFrames === 0 && i < 1000); ++i) {
        const [x, y, z] = pose.eye;
        const [c, s] = [Math.cos(i / 100), Math.sin(i / 100)];
        window.intervale.set({ pose: { ...pose, eye: [c * x - s * y, s * x + c * y, z] } });
        await new Promise((resolve) => requestAnimationFrame(resolve));
      }
    });
    const png = await page.locator('#canvas').screenshot();
    writeFileSync(join(process.env.INTERVALE_WEB_OUT, `moving-${name.replace(' ', '-')}.png`), png);
    const { coarseFrames } = await page.evaluate(() => ({ ...window.intervale.stats }));
    assert.ok(coarseFrames > 0);
    assert.deepEqual(errors, []);
    await close();
  });
}
