// Every control of the page, in a real browser with a fake worker: its effect on the picture, on the view's state, or
// on the requests to the worker.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { decode, difference, eventually, pixels, share } from './browser.mjs';
import { changesPicture, openPage, recordRequests, refined, settled, sharedPages, startFakeServer, state } from './fake_server.mjs';

const shared = sharedPages();
const { onPage } = shared;
const stats = (page) => page.evaluate(() => ({ ...window.intervale.stats }));
async function drag(page, from, by, steps = 5) {
  await page.mouse.move(...from);
  await page.mouse.down();
  await page.mouse.move(from[0] + by[0], from[1] + by[1], { steps });
  await page.mouse.up();
  await settled(page);
}
async function handle(page, label, exact = false) {
  const { x, y, width, height } = await page.getByRole('button', { name: label, exact }).boundingBox();
  return [x + width / 2, y + height / 2];
}
onPage('the mouse and keys rotate, pan and zoom; reset restores the view', async (page) => {
  const first = await pixels(page);
  assert.equal((await state(page)).pose, null);
  await changesPicture(page, () => drag(page, [400, 400], [120, 40]));
  const turned = (await state(page)).pose;
  await changesPicture(page, () => page.keyboard.down('Shift').then(() => drag(page, [400, 400], [80, 0])).then(() => page.keyboard.up('Shift')));
  const moved = (await state(page)).pose;
  assert.notDeepEqual(moved.lookAt, turned.lookAt);
  await page.mouse.move(300, 300);
  await changesPicture(page, () => page.mouse.wheel(0, -400));
  await page.focus('#canvas');
  for (const key of ['ArrowLeft', 'ArrowUp', 'Shift+ArrowRight', '+', '-']) await changesPicture(page, () => page.keyboard.press(key));
  await page.click('#reset');
  await settled(page);
  assert.ok(difference(first, await pixels(page)).share < 0.001);
});

onPage('a double click sets the centre of rotation', async (page) => {
  await page.mouse.dblclick(350, 300);
  const { lookAt, eye } = (await state(page)).pose;
  assert.ok(lookAt.every((x) => Math.abs(x) < 40) && lookAt.some((x) => Math.abs(x) > 1), String(lookAt));
  assert.notDeepEqual(eye, lookAt);
});

onPage('one finger rotates, two zoom', async (page) => {
  const touch = (type, points) => page.evaluate(([t, list]) => {
    const canvas = window.intervale.canvas;
    for (const [pointerId, clientX, clientY] of list) {
      canvas.dispatchEvent(new PointerEvent(t, { pointerId, clientX, clientY, pointerType: 'touch', bubbles: true }));
    }
  }, [type, points]);
  await page.evaluate(() => (window.intervale.canvas.setPointerCapture = () => {}));
  const distance = async () => {
    const { eye, lookAt } = (await state(page)).pose;
    return Math.hypot(...eye.map((x, i) => x - lookAt[i]));
  };
  await touch('pointerdown', [[1, 200, 300]]);
  await touch('pointermove', [[1, 260, 300]]);
  const before = await distance();
  await touch('pointerdown', [[2, 300, 300]]);
  await touch('pointermove', [[2, 340, 300]]);
  assert.ok((await distance()) < 0.6 * before);
  await touch('pointerup', [[1, 260, 300], [2, 340, 300]]);
});

onPage('the clip plane shows a cap, and handles, keys, buttons and the slider move and rotate it', async (page) => {
  await changesPicture(page, () => page.keyboard.press('c'));
  await page.waitForFunction(() => window.intervale.stats.capTriangles > 100);
  const plane = async () => (await state(page)).clip;
  let last = await plane();
  const moved = async (what) => {
    const now = await plane();
    assert.notDeepEqual(now, last, what);
    last = now;
  };
  await changesPicture(page, async () => drag(page, await handle(page, 'Move the clip plane'), [30, 30]));
  await moved('dragged');
  await changesPicture(page, async () => drag(page, await handle(page, 'Rotate the clip plane'), [40, -30]));
  await moved('rotated');
  assert.ok(Math.abs(Math.hypot(...last.normal) - 1) < 1e-6);
  await page.getByRole('button', { name: 'Move the clip plane' }).focus();
  await page.keyboard.press('Shift+ArrowUp');
  await moved('by a key');
  for (const id of ['clip-x', 'clip-y', 'clip-z', 'clip-view', 'clip-flip']) {
    await page.click(`#${id}`);
    await moved(id);
  }
  await page.click('#clip-x');
  await page.fill('#clip-offset', '0.25');
  await moved('by the slider');
  for (let k = 0; k < 2; ++k) {
    await eventually(async () => assert.equal(await page.textContent('#clip-offset-out'), '−12', 'the coordinate, whichever way the plane faces'));
    await eventually(async () => assert.equal(Number(await page.inputValue('#clip-offset')), 0.25));
    await page.click('#clip-flip');
  }
  await settled(page);
  await changesPicture(page, () => page.click('#clip'));
  await page.waitForFunction(() => window.intervale.stats.capTriangles === 0);
});

onPage('handles and fields move the region and its faces', async (page) => {
  await page.keyboard.press('g');
  await settled(page);
  const region = async () => (await state(page)).region;
  const first = await region();
  assert.deepEqual(first, { min: [-12, -12, -12], max: [12, 12, 12] });
  await drag(page, await handle(page, "Move the region's upper Z face"), [0, -40]);
  const taller = await region();
  assert.ok(taller.max[2] > 12 && taller.min[2] === -12, JSON.stringify(taller));
  await drag(page, await handle(page, 'Move the region', true), [30, 0]);
  const shifted = await region();
  assert.ok(Math.abs(shifted.max[2] - shifted.min[2] - (taller.max[2] - taller.min[2])) < 1e-9);
  assert.notDeepEqual(shifted, taller);
  await page.getByLabel('From X').fill('-20');
  await page.keyboard.press('Tab');
  assert.equal((await region()).min[0], -20);
  await page.evaluate(() => window.intervale.set({ region: { min: [-12.345678, -1.2345e-5, -20], max: [-1.2345, 12.345, 21] } }));
  const cut = await page.$$eval('#region-fields input', (fields) => fields.filter((f) => f.scrollWidth > f.clientWidth).map((f) => f.value));
  assert.deepEqual(cut, [], 'long numbers are seen whole');
});

onPage('shrunken tetrahedra replace the boundary surface in the region', async (page) => {
  await changesPicture(page, () => page.keyboard.press('s'), 0.002);
  await page.waitForFunction(() => window.intervale.stats.tets > 100);
  await settled(page);
  const shown = await pixels(page);
  for (const name of ['alpha', 'beta', 'box']) await page.fill(`#${name}-opacity`, '0.25');
  await settled(page);
  assert.ok(difference(shown, await pixels(page)).share < 0.001, 'the surfaces around do not hide them');
  for (const name of ['alpha', 'beta', 'box']) await page.fill(`#${name}-opacity`, '1');
  await eventually(async () => assert.match(await page.textContent('#tets-note'), /tetrahedra in the region/));
  await changesPicture(page, () => page.fill('#shrink', '0.4'), 0.002);
  await changesPicture(page, () => page.click('#tets'), 0.002);
  await page.waitForFunction(() => window.intervale.stats.tets === 0);
});

onPage('thickness has a legend in world units', async (page) => {
  await page.keyboard.press('t');
  await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
  await page.waitForSelector('#legend:not([hidden])');
  await eventually(async () => assert.ok(Number.parseFloat(await page.textContent('#legend-high')) > 20, 'with the first picture'));
  await changesPicture(page, () => page.click('#thickness'), 0.1);
  await changesPicture(page, () => page.click('#thickness'), 0.1);
  await changesPicture(page, () => page.click('#thickness'), 0.1);
  await eventually(async () => assert.ok(!(await page.isVisible('#legend'))));
});

onPage('colours, opacities, wireframe and levels of detail change the picture', async (page) => {
  await changesPicture(page, () => page.fill('#alpha-color', '#d02020'));
  for (const name of ['alpha', 'beta', 'box']) await changesPicture(page, () => page.fill(`#${name}-opacity`, '0.3'));
  for (const name of ['alpha', 'beta', 'box']) await page.fill(`#${name}-opacity`, '0');
  await settled(page);
  const empty = await pixels(page);
  assert.equal(share(empty, (r, g, b) => r === empty.data[0] && g === empty.data[1] && b === empty.data[2]), 1, 'everything is invisible');
  for (const name of ['alpha', 'beta', 'box']) await page.fill(`#${name}-opacity`, '1');
  for (const name of ['wireframe', 'levels']) await changesPicture(page, () => page.click(`#${name}`), 0.02);
});

onPage('the worker is asked for the chosen detail, and for the last view of a motion', async (page) => {
  await recordRequests(page);
  const requested = (key, value) => page.waitForFunction(([k, v]) => window.requests.some((r) => r.type === 'view' && r.view[k] === v), [key, value]);
  await page.fill('#pixel-error', '20');
  await requested('pixelError', 2);
  await page.fill('#max-tets', '4');
  await requested('maxTets', 100000);
  await page.fill('#memory', '3');
  await requested('maxUpdates', Math.round(5e6 / 30));
  await page.evaluate(() => (window.requests.length = 0));
  await drag(page, [300, 300], [200, 100], 60);
  const views = await page.evaluate(() => window.requests.filter((r) => r.type === 'view').map((r) => r.view.camera));
  const { pose } = await state(page);
  assert.deepEqual(views.at(-1).eye, pose.eye, 'the last view of the motion');
  const [width, height] = await page.evaluate(() => [window.intervale.canvas.width, window.intervale.canvas.height]);
  assert.deepEqual(views.at(-1).viewport, [width, height]);
});

onPage('the address restores the picture', async (page) => {
  await page.keyboard.press('c');
  await drag(page, [400, 400], [100, 50]);
  const { surfaceVersion } = await stats(page);
  await page.keyboard.press('w');
  await page.waitForFunction((version) => window.intervale.stats.surfaceVersion > version, surfaceVersion); // it has edges now
  await page.waitForFunction(() => location.hash.includes('wireframe') && location.hash.includes('eye='));
  await settled(page);
  const [old, url] = [await pixels(page), page.url()];
  const other = await openPage(shared.browser, url);
  await refined(other);
  await other.waitForFunction(() => window.intervale.stats.capTriangles > 0);
  await settled(other);
  assert.ok(difference(old, await pixels(other)).share < 0.002);
  await other.context().close();
});

onPage('an address that is entered while another is due to be written is kept', async (page) => {
  await page.evaluate(() => {
    window.intervale.set({ wireframe: true });
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = () => (location.hash = '#data=full'); // the timer is due: it runs before 'hashchange' is told
    port2.postMessage(null);
    const due = performance.now() + 400;
    while (performance.now() < due);
  });
  await page.waitForFunction(() => window.intervale.progress?.full);
  await settled(page);
  assert.ok(page.url().includes('data=full'));
});

onPage('pictures and meshes are saved', async (page) => {
  for (const [id, name] of [['save-picture', 'gyroid.png'], ['save-vtu', 'gyroid.vtu'], ['save-stl', 'gyroid.stl'], ['save-glb', 'gyroid.glb']]) {
    const [download] = await Promise.all([page.waitForEvent('download'), page.click(`#${id}`)]);
    assert.equal(download.suggestedFilename(), name);
  }
});

onPage('choosing another data set resets the view', async (page) => {
  await page.keyboard.press('c');
  await page.getByRole('radio', { name: 'full' }).check();
  await page.waitForFunction(() => window.intervale.progress?.full && window.intervale.progress.done);
  assert.equal((await state(page)).clip, null);
  await page.waitForFunction(() => document.querySelector('#progress-text').textContent === 'Done: memory limit reached');
});

onPage('the picture returns when a lost WebGL context is restored', async (page) => {
  const old = await pixels(page);
  await page.evaluate(() => {
    const extension = window.intervale.canvas.getContext('webgl2').getExtension('WEBGL_lose_context');
    extension.loseContext();
    setTimeout(() => extension.restoreContext(), 500);
  });
  await page.waitForFunction(() => document.querySelector('#banner-text').textContent.includes('context was lost'));
  await page.waitForFunction(() => document.querySelector('#banner').hidden);
  await settled(page);
  assert.ok(difference(old, await pixels(page)).share < 0.001);
  page.problems = page.problems.filter((text) => !text.includes('Context Lost'));
});

onPage('Tab reaches every control, and the help lists the keys', async (page) => {
  await page.keyboard.press('g');
  await page.keyboard.press('c');
  const expected = await page.evaluate(() => {
    const isReachable = (e) => e.checkVisibility() && !e.disabled && (e.type !== 'radio' || e.checked);
    return [...document.querySelectorAll('button, input, canvas[tabindex]')].filter(isReachable).length;
  });
  await page.focus('#canvas');
  const seen = new Set();
  for (let i = 0; i < expected + 5; ++i) {
    seen.add(await page.evaluate(() => [...document.querySelectorAll('*')].indexOf(document.activeElement)));
    await page.keyboard.press('Tab');
  }
  assert.ok(seen.size >= expected, `${seen.size} of ${expected}`);
  await page.keyboard.press('h');
  await eventually(async () => assert.ok(await page.isVisible('#help-dialog')));
  assert.equal(await page.locator('#keys dt').count(), 16);
  await page.keyboard.press('Escape');
  await eventually(async () => assert.ok(!(await page.isVisible('#help-dialog'))));
});

for (const [width, height] of [[360, 740], [3840, 2160]]) {
  onPage(`at ${width} x ${height} nothing is clipped by the window`, async (page) => {
    const toggle = page.locator('#panel-toggle');
    if (await toggle.isVisible()) await toggle.click();
    await page.keyboard.press('c');
    await page.keyboard.press('g');
    await settled(page);
    const clipped = await page.evaluate(() => {
      const panel = document.querySelector('#panel');
      const isClipped = (e) => e.checkVisibility() && e.getBoundingClientRect().right > window.innerWidth + 1;
      const out = [...document.querySelectorAll('#panel *, .tools *')].filter(isClipped).map((e) => e.id || e.tagName);
      return [...out, ...(panel.scrollWidth > panel.clientWidth + 1 ? ['the panel scrolls horizontally'] : [])];
    });
    assert.deepEqual(clipped, []);
    const canvas = await page.locator('#canvas').boundingBox();
    assert.ok(canvas.height > 0.3 * height && canvas.width > 0.5 * Math.min(width, 2000));
  }, { width, height });
}

test('the banner explains lost connections and errors', async () => {
  const page = await openPage(shared.browser, shared.server.address + '#data=lost');
  await page.waitForFunction(() => /Connection lost: .* Reconnecting in [1-8] s/.test(document.querySelector('#banner-text').textContent));
  await page.waitForFunction(() => document.querySelector('#banner-text').textContent === 'Reconnected: the stream was resumed.');
  await refined(page);
  await page.goto(shared.server.address + '#data=broken');
  await page.reload();
  await page.getByRole('button', { name: 'Try again' }).click();
  await page.waitForFunction(() => document.querySelector('#banner-text').textContent.includes('no such data set'));
  await page.goto(shared.server.address + '#data=nothing-of-this-name');
  await page.reload();
  await page.waitForFunction(() => document.querySelector('#banner-text').textContent.includes('nothing-of-this-name'));
  await page.context().close();
});

test('a required token is requested, and is not part of the address', async () => {
  const guarded = await startFakeServer('open sesame');
  const page = await openPage(shared.browser, guarded.address);
  await page.fill('#token', 'wrong');
  await page.keyboard.press('Enter');
  await page.fill('#token', 'open sesame');
  await page.keyboard.press('Enter');
  await refined(page);
  assert.ok(!page.url().includes('sesame'));
  await page.context().close();
  guarded.close();
});

test('without WebGL 2 the banner says so', async () => {
  const page = await openPage(shared.browser, shared.server.address, { script: () => (HTMLCanvasElement.prototype.getContext = () => null) });
  await page.waitForFunction(() => document.querySelector('#banner-text').textContent.includes('WebGL 2'));
  await eventually(async () => assert.ok(await page.isVisible('#banner')));
  await page.context().close();
});

// A software renderer takes longer than 1/240 s for any picture.
onPage('while the camera moves a coarser mesh is drawn, if there is a frame rate, and all of it at rest', async (page) => {
  await recordRequests(page);
  const standIns = () => page.evaluate(() => window.requests.filter(({ type }) => type === 'standIn').map(({ triangles }) => triangles));
  const turn = () => page.evaluate(async () => {
    for (let i = 0; i < 60; ++i) {
      const pose = { eye: [150 * Math.cos(i / 60), 150 * Math.sin(i / 60), 60], lookAt: [0, 0, 0], up: [0, 0, 1], fov: 30 };
      window.intervale.set({ pose });
      await new Promise((resolve) => requestAnimationFrame(resolve));
    }
  });
  await page.evaluate(() => window.intervale.set({ frameRate: 0 }));
  await turn();
  assert.equal((await stats(page)).coarseFrames, 0);
  assert.deepEqual((await standIns()).filter((triangles) => triangles !== null), []);
  await settled(page);
  const picture = async () => decode(page, (await page.locator('#canvas').screenshot()).toString('base64'));
  const full = await picture();
  await page.evaluate(() => window.intervale.set({ frameRate: 240 }));
  await turn();
  await turn();
  assert.ok((await stats(page)).coarseFrames > 0);
  assert.ok((await standIns()).at(-1) >= 1000);
  await page.waitForFunction(() => !window.intervale.stats.isCoarse);
  await settled(page);
  assert.ok(difference(full, await picture()).share < 0.001, 'the same as without a frame rate');
});
