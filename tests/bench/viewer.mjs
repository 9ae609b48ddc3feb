// What the viewer does in a browser, in figures, as a table: node viewer.mjs FILE.ivm BUCKYBALL.ivm EVERY.ivm [RUNS]
// FILE: large, for everything but the first mesh. Its recorded moves are in full detail, with the frame rate that is the
// default, and with any (all of the mesh in each picture); and of hardly any mesh, which is what pixels alone take.
// EVERY: the buckyball's field for every range, for changes of the range. The environment is that of
// tests/web/support.mjs. Best on an idle machine.
import { copyFileSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { basename, join } from 'node:path';

import { drawn, killServers, launch, open, program, progressOf, serve, set, settled } from '../web/support.mjs';

const [file, small, every, runs = '5'] = process.argv.slice(2);
const folder = mkdtempSync(join(tmpdir(), 'intervale-bench-'));
for (const path of [file, small, every]) copyFileSync(path, join(folder, basename(path)));
const name = basename(file, '.ivm');
const smallName = basename(small, '.ivm');
const everyName = basename(every, '.ivm');
const server = await serve(folder);
const median = (values) => values.sort((a, b) => a - b)[Math.floor(values.length / 2)];
const everything = '-1e6,-1e6,-1e6,1e6,1e6,1e6';

// The same for every run: the camera goes once around the box, up and down a little, and to half the distance and back.
// Returns the pictures a second, the longest that one took, on the graphics card, too, and the share with a stand-in.
const recordedMove = (page) =>
  page.evaluate(async () => {
    const { intervale } = window;
    const { stats } = intervale;
    const { pose } = intervale.state;
    const [x, y, z] = pose.eye.map((eye, i) => eye - pose.lookAt[i]);
    const poseAt = (t) => {
      const [turn, near] = [2 * Math.PI * t, 0.75 + 0.25 * Math.cos(2 * Math.PI * t)];
      const [c, s] = [Math.cos(turn), Math.sin(turn)];
      const around = [c * x - s * y, s * x + c * y, z + 0.3 * Math.hypot(x, y) * s];
      return { ...pose, eye: around.map((d, i) => pose.lookAt[i] + near * d), up: [0, 0, 1] };
    };
    const [seconds, before, coarse, start] = [8, stats.frames, stats.coarseFrames, performance.now()];
    stats.longestFrame = 0;
    for (let t = 0; t < 1; t = (performance.now() - start) / (1000 * seconds)) {
      intervale.set({ pose: poseAt(t) });
      await new Promise((resolve) => requestAnimationFrame(resolve));
    }
    const frames = stats.frames - before;
    return { rate: (1000 * frames) / (performance.now() - start), longest: stats.longestFrame, coarse: (stats.coarseFrames - coarse) / frames };
  });

async function measureMove(browser, frameRate, pixelError) {
  const { page, close } = await open(browser, `${server.url}#data=${name}&px=${pixelError}&fps=${frameRate}`, { width: 400, height: 300 });
  await page.press('#canvas', 'ArrowLeft'); // from here on the view has a camera of its own
  await settled(page);
  await drawn(page);
  // Once the mesh has settled, its picture was drawn, and a stand-in is there if one is wanted.
  if (frameRate > 0) await page.waitForFunction(() => window.intervale.stats.standInTriangles > 0, null, { timeout: 30_000 }).catch(() => {});
  const { triangles } = await progressOf(page);
  const move = { ...(await recordedMove(page)), triangles };
  await close();
  return move;
}

const figures = { coarseMove: [], fullMove: [], emptyMove: [], speed: [], native: [], block: [], first: [], size: [], memory: [], range: [] };
for (let run = 0; run < Number(runs); ++run) {
  const browser = await launch();
  {
    const { page, downloaded } = await open(browser, `${server.url}#data=${name}&roi=${everything}`, { width: 320, height: 240 });
    await settled(page);
    const progress = await progressOf(page);
    figures.speed.push(progress.busy.updates / progress.busy.seconds);
    figures.memory.push(progress.memory / (progress.updates / 1e6));
    figures.block.push(await page.evaluate(() => window.intervale.stats.longestBlock));
    figures.size.push(downloaded());
  }
  figures.coarseMove.push(await measureMove(browser, 60, 0.1));
  figures.fullMove.push(await measureMove(browser, 0, 0.1));
  figures.emptyMove.push(await measureMove(browser, 0, 64));
  {
    const { page } = await open(browser, `${server.url}#data=${smallName}`, { width: 320, height: 240 });
    await settled(page);
    figures.first.push(await page.evaluate(() => window.intervale.stats.firstMeshMs));
  }
  {
    const { page } = await open(browser, `${server.url}#data=${everyName}&range=128,188&roi=${everything}`, { width: 320, height: 240 });
    for (const range of [[128, 188], [140, 188]]) await set(page, { range }); // from here on the client has both
    const ms = await page.evaluate(async (range) => {
      await window.intervale.photograph(); // all drawing has ended
      const start = performance.now();
      const surface = window.intervale.next('surface');
      window.intervale.set({ range });
      await surface;
      return performance.now() - start;
    }, [130, 188]);
    await settled(page);
    const { updatesInMesh } = await progressOf(page);
    figures.range.push((ms * 1e5) / updatesInMesh);
  }
  await browser.close();
  const fetched = JSON.parse(program('intervale-client', 'fetch', `ws://${server.address}/${name}`, '--json'));
  figures.native.push(fetched.updates / fetched.seconds_applying);
}
killServers();
rmSync(folder, { recursive: true });

const moved = (moves) => {
  const of = (key) => median(moves.map((move) => move[key]));
  return `${of('rate').toFixed(1)} a second, the longest ${of('longest').toFixed(0)} ms; ${(100 * of('coarse')).toFixed(0)} % of them with a stand-in`;
};
const triangles = (moves) => `${median(moves.map((move) => move.triangles)).toLocaleString('en')} triangles`;
const rows = [
  [`pictures while the camera moves, 400 × 300, of ${triangles(figures.coarseMove)}, frame rate 60`, moved(figures.coarseMove)],
  [`${triangles(figures.fullMove)}, any frame rate`, moved(figures.fullMove)],
  [`${triangles(figures.emptyMove)}, any frame rate`, moved(figures.emptyMove)],
  ['updates decoded and applied in the worker, a second', median(figures.speed).toLocaleString('en', { maximumFractionDigits: 0 })],
  ['the native client, the same stream', median(figures.native).toLocaleString('en', { maximumFractionDigits: 0 })],
  ['relative to the native speed', median(figures.speed.map((speed, i) => speed / figures.native[i])).toFixed(2)],
  ['longest time that streaming blocked the page', `${median(figures.block).toFixed(1)} ms`],
  ['downloaded before any data, gzipped', `${(median(figures.size) / 1000).toFixed(0)} kB`],
  [`from navigation to the first mesh of ${smallName}`, `${median(figures.first).toFixed(0)} ms`],
  ['from a change of the range to its boundary surface in the page, for 100,000 updates shown', `${median(figures.range).toFixed(0)} ms`],
  ['memory of the worker\'s core for a million updates', `${(median(figures.memory) / 1e6).toFixed(0)} MB`],
];
console.log(`${name}, headless Chromium, software drawing; medians of ${runs} runs\n\n| figure | |\n|---|---|`);
for (const [figure, value] of rows) console.log(`| ${figure} | ${value} |`);
process.exit(0);
