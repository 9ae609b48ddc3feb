// Every control does what it says, in a real browser with a stand-in for the worker: on pixels, on the view, or on what the worker is asked.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { difference, launch, openPage, pixels, settled, share, startStand, untilDone } from './stand.mjs';

let browser;
let stand;
before(async () => {
  [browser, stand] = await Promise.all([launch(), startStand()]);
});
after(async () => {
  await browser.close();
  stand.close();
});

// run: with a page on which the gyroid is done. The page must not complain.
const onPage = (name, run, { hash = '#data=gyroid', ...layout } = {}) =>
  test(name, async () => {
    const page = await openPage(browser, stand.address + hash, layout);
    await untilDone(page);
    await run(page);
    assert.deepEqual(page.complaints, []);
    await page.context().close();
  });
const state = (page) => page.evaluate(() => window.intervale.state);
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
// Waits for it: some changes come from the worker.
async function changesPicture(page, act, least = 0.01) {
  const old = await pixels(page);
  await act();
  let changed = 0;
  for (const end = Date.now() + 15_000; changed < least && Date.now() < end; ) {
    await settled(page);
    changed = difference(old, await pixels(page));
  }
  assert.ok(changed >= least, `${changed} of the picture changed`);
}

onPage('turning, moving and zooming by mouse and keys; reset', async (page) => {
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
  assert.ok(difference(first, await pixels(page)) < 0.001);
});

onPage('a double click brings what is there to the middle', async (page) => {
  await page.mouse.dblclick(350, 300);
  const { lookAt, eye } = (await state(page)).pose;
  assert.ok(lookAt.every((x) => Math.abs(x) < 40) && lookAt.some((x) => Math.abs(x) > 1), String(lookAt));
  assert.notDeepEqual(eye, lookAt);
});

onPage('fingers: one turns, two zoom', async (page) => {
  const touch = (type, points) => page.evaluate(([t, list]) => {
    const canvas = window.intervale.canvas;
    for (const [id, x, y] of list) canvas.dispatchEvent(new PointerEvent(t, { pointerId: id, clientX: x, clientY: y, pointerType: 'touch', bubbles: true }));
  }, [type, points]);
  await page.evaluate(() => (window.intervale.canvas.setPointerCapture = () => {}));
  const away = async () => page.evaluate(() => { const { eye, lookAt } = window.intervale.state.pose; return Math.hypot(...eye.map((x, i) => x - lookAt[i])); });
  await touch('pointerdown', [[1, 200, 300]]);
  await touch('pointermove', [[1, 260, 300]]);
  const before = await away();
  await touch('pointerdown', [[2, 300, 300]]);
  await touch('pointermove', [[2, 340, 300]]);
  assert.ok((await away()) < 0.6 * before);
  await touch('pointerup', [[1, 260, 300], [2, 340, 300]]);
});

onPage('the clip plane caps the solid, and is moved and turned by handles, keys, buttons and slider', async (page) => {
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
  await changesPicture(page, async () => drag(page, await handle(page, 'Turn the clip plane'), [40, -30]));
  await moved('turned');
  assert.ok(Math.abs(Math.hypot(...last.normal) - 1) < 1e-6);
  await page.getByRole('button', { name: 'Move the clip plane' }).focus();
  await page.keyboard.press('Shift+ArrowUp');
  await moved('by a key');
  for (const id of ['clip-x', 'clip-y', 'clip-z', 'clip-view', 'clip-flip']) {
    await page.click(`#${id}`);
    await moved(id);
  }
  await page.fill('#clip-offset', '0.25');
  await moved('by the slider');
  await settled(page);
  await changesPicture(page, () => page.click('#clip'));
  await page.waitForFunction(() => window.intervale.stats.capTriangles === 0);
});

onPage('the region is asked for, and is dragged by its faces and as a whole', async (page) => {
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
});

onPage('shrunken tetrahedra take the place of the skin in the region', async (page) => {
  await changesPicture(page, () => page.keyboard.press('s'), 0.002);
  await page.waitForFunction(() => window.intervale.stats.tets > 100);
  assert.match(await page.textContent('#tets-note'), /tetrahedra in the region/);
  await changesPicture(page, () => page.fill('#shrink', '0.4'), 0.002);
  await changesPicture(page, () => page.click('#tets'), 0.002);
  await page.waitForFunction(() => window.intervale.stats.tets === 0);
});

onPage('thickness is drawn with a legend in world units', async (page) => {
  await changesPicture(page, () => page.keyboard.press('t'), 0.1);
  assert.ok(await page.isVisible('#legend'));
  await page.waitForFunction(() => Number.parseFloat(document.querySelector('#legend-high').textContent) > 20);
  await changesPicture(page, () => page.click('#thickness'), 0.1);
  assert.ok(!(await page.isVisible('#legend')));
});

onPage('colours, opacities, wireframe and levels show', async (page) => {
  await changesPicture(page, () => page.fill('#alpha-color', '#d02020'));
  for (const name of ['alpha', 'beta', 'box']) await changesPicture(page, () => page.fill(`#${name}-opacity`, '0.3'));
  for (const name of ['alpha', 'beta', 'box']) await page.fill(`#${name}-opacity`, '0');
  await settled(page);
  const empty = await pixels(page);
  assert.equal(share(empty, (r, g, b) => r === empty.data[0] && g === empty.data[1] && b === empty.data[2]), 1, 'nothing is left');
  for (const name of ['alpha', 'beta', 'box']) await page.fill(`#${name}-opacity`, '1');
  for (const name of ['wireframe', 'levels']) await changesPicture(page, () => page.click(`#${name}`), 0.02);
});

onPage('detail is asked for', async (page) => {
  await page.evaluate(() => {
    window.asked = [];
    const post = Worker.prototype.postMessage;
    Worker.prototype.postMessage = function (...message) {
      window.asked.push(message[0]);
      post.apply(this, message);
    };
  });
  const asked = (key, value) => page.waitForFunction(([k, v]) => window.asked.some((r) => r.type === 'view' && r.view[k] === v), [key, value]);
  await page.fill('#pixel-error', '20');
  await asked('pixelError', 2);
  await page.fill('#max-tets', '4');
  await asked('maxTets', 100000);
  await page.fill('#memory', '3');
  await asked('maxUpdates', Math.round(5e6 / 30));
  await page.evaluate(() => (window.asked.length = 0));
  await drag(page, [300, 300], [200, 100], 60);
  const views = await page.evaluate(() => window.asked.filter((r) => r.type === 'view').map((r) => r.view.camera));
  const { pose } = await state(page);
  assert.deepEqual(views.at(-1).eye, pose.eye, 'the last of a motion');
  const [width, height] = await page.evaluate(() => [window.intervale.canvas.width, window.intervale.canvas.height]);
  assert.deepEqual(views.at(-1).viewport, [width, height]);
});

onPage('the address gives the same picture', async (page) => {
  await page.keyboard.press('c');
  await drag(page, [400, 400], [100, 50]);
  await page.keyboard.press('w');
  await page.waitForFunction(() => location.hash.includes('wireframe') && location.hash.includes('eye='));
  await settled(page);
  const [old, url] = [await pixels(page), page.url()];
  const other = await openPage(browser, url);
  await untilDone(other);
  await other.waitForFunction(() => window.intervale.stats.capTriangles > 0);
  await settled(other);
  assert.ok(difference(old, await pixels(other)) < 0.002);
  await other.context().close();
});

onPage('pictures and meshes are saved', async (page) => {
  for (const [id, name] of [['save-picture', 'gyroid.png'], ['save-vtu', 'gyroid.vtu'], ['save-stl', 'gyroid.stl'], ['save-glb', 'gyroid.glb']]) {
    const [download] = await Promise.all([page.waitForEvent('download'), page.click(`#${id}`)]);
    assert.equal(download.suggestedFilename(), name);
  }
});

onPage('another data set starts afresh', async (page) => {
  await page.keyboard.press('c');
  await page.getByRole('radio', { name: 'full' }).check();
  await page.waitForFunction(() => window.intervale.progress?.full && window.intervale.progress.done);
  assert.equal((await state(page)).clip, null);
  await page.waitForFunction(() => document.querySelector('#progress-text').textContent === 'Done: no room for more');
});

onPage('a lost picture comes back', async (page) => {
  const old = await pixels(page);
  await page.evaluate(() => {
    const extension = window.intervale.canvas.getContext('webgl2').getExtension('WEBGL_lose_context');
    extension.loseContext();
    setTimeout(() => extension.restoreContext(), 500);
  });
  await page.waitForFunction(() => document.querySelector('#banner-text').textContent.includes('dropped'));
  await page.waitForFunction(() => document.querySelector('#banner').hidden);
  await settled(page);
  assert.ok(difference(old, await pixels(page)) < 0.001);
  page.complaints = page.complaints.filter((text) => !text.includes('Context Lost'));
});

onPage('everything can be reached by Tab, and the help lists the keys', async (page) => {
  await page.keyboard.press('g');
  await page.keyboard.press('c');
  const expected = await page.evaluate(() => [...document.querySelectorAll('button, input, canvas[tabindex]')].filter((e) => e.checkVisibility() && !e.disabled && (e.type !== 'radio' || e.checked)).length);
  await page.focus('#canvas');
  const seen = new Set();
  for (let i = 0; i < expected + 5; ++i) {
    seen.add(await page.evaluate(() => (window.ids ??= new Map(), [...document.querySelectorAll('*')].indexOf(document.activeElement))));
    await page.keyboard.press('Tab');
  }
  assert.ok(seen.size >= expected, `${seen.size} of ${expected}`);
  await page.keyboard.press('h');
  assert.ok(await page.isVisible('#help-dialog'));
  assert.equal(await page.locator('#keys dt').count(), 13);
  await page.keyboard.press('Escape');
  assert.ok(!(await page.isVisible('#help-dialog')));
});

for (const [width, height] of [[360, 740], [3840, 2160]]) {
  onPage(`at ${width} x ${height} nothing is cut off`, async (page) => {
    const toggle = page.locator('#panel-toggle');
    if (await toggle.isVisible()) await toggle.click();
    await page.keyboard.press('c');
    await page.keyboard.press('g');
    await settled(page);
    const beyond = await page.evaluate(() => {
      const panel = document.querySelector('#panel');
      const out = [...panel.querySelectorAll('*'), ...document.querySelectorAll('.tools *')].filter((e) => e.checkVisibility() && e.getBoundingClientRect().right > window.innerWidth + 1).map((e) => e.id || e.tagName);
      return [...out, ...(panel.scrollWidth > panel.clientWidth + 1 ? ['panel scrolls sideways'] : [])];
    });
    assert.deepEqual(beyond, []);
    const canvas = await page.locator('#canvas').boundingBox();
    assert.ok(canvas.height > 0.3 * height && canvas.width > 0.5 * Math.min(width, 2000));
  }, { width, height });
}

test('lost connections and errors are said in words', async () => {
  const page = await openPage(browser, stand.address + '#data=lost');
  await page.waitForFunction(() => /Connection lost: .* Connecting again in [1-8] s/.test(document.querySelector('#banner-text').textContent));
  await page.waitForFunction(() => document.querySelector('#banner-text').textContent === 'Connected again: the stream goes on where it was.');
  await untilDone(page);
  await page.goto(stand.address + '#data=broken');
  await page.reload();
  await page.getByRole('button', { name: 'Try again' }).click();
  await page.waitForFunction(() => document.querySelector('#banner-text').textContent.includes('no such data set'));
  await page.goto(stand.address + '#data=nothing-of-this-name');
  await page.reload();
  await page.waitForFunction(() => document.querySelector('#banner-text').textContent.includes('nothing-of-this-name'));
  await page.context().close();
});

test('a token is asked for, and not put into the address', async () => {
  const guarded = await startStand('open sesame');
  const page = await openPage(browser, guarded.address);
  await page.fill('#token', 'wrong');
  await page.keyboard.press('Enter');
  await page.fill('#token', 'open sesame');
  await page.keyboard.press('Enter');
  await untilDone(page);
  assert.ok(!page.url().includes('sesame'));
  await page.context().close();
  guarded.close();
});
