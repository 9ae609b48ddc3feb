// The probe: the value and the position under the pointer, in a real browser with a fake worker.
import assert from 'node:assert/strict';
import { settled, sharedPages, state } from './fake_server.mjs';

const { onPage } = sharedPages();
const kStyles = (opacities) => Object.entries(opacities).map(([name, opacity]) => `&${name}=808080,${opacity}`).join('');
const withProbe = (hash, opacities = {}) => ({ width: 760, height: 400, hash: `#data=gyroid&show=probe${hash}${kStyles(opacities)}` });

const label = async (page) => (await page.isVisible('#probe-label')) ? page.$$eval('#probe-value, #probe-position', (parts) => parts.map((part) => part.textContent)) : null;
// What the probe tells at points in the middle of the canvas, but where a handle is.
async function sweep(page, columns = 5, rows = 3) {
  const { x, y, width, height } = await page.locator('#canvas').boundingBox();
  const told = [];
  for (let i = 0; i < columns * rows; ++i) {
    const [right, down] = [((i % columns) + 0.5) / columns, (Math.floor(i / columns) + 0.5) / rows].map((share) => 0.2 + 0.6 * share);
    const at = [x + right * width, y + down * height];
    if (await page.evaluate((point) => document.elementFromPoint(...point).id !== 'canvas', at)) continue;
    const { probes } = await page.evaluate(() => ({ ...window.intervale.stats }));
    await page.mouse.move(...at);
    await page.waitForFunction((before) => window.intervale.stats.probes > before, probes);
    const found = await label(page);
    if (found) told.push({ value: found[0], position: found[1].replaceAll('−', '-').split(', ').map(Number) });
  }
  return told;
}

onPage('tells the value of the surface under the pointer, and nothing where nothing is', async (page) => {
  const told = await sweep(page);
  assert.ok(told.length > 3 && told.length < 15, `${told.length} points have something`);
  for (const { value, position } of told) {
    assert.equal(value, 'field = −0.45');
    assert.ok(position.length === 3 && position.every((x) => Math.abs(x) <= 24.01), String(position));
  }
  await page.mouse.move(4, 4);
  await page.waitForSelector('#probe-label', { state: 'hidden' });
  await page.keyboard.press('p');
  assert.equal((await state(page)).probe, false);
  await page.mouse.move(200, 150);
  await settled(page);
  assert.equal(await label(page), null);
}, withProbe('', { beta: 0, box: 0 }));

onPage('tells the values of a cut, between those of the surfaces, at points of the plane', async (page) => {
  await page.waitForFunction(() => window.intervale.stats.capTriangles > 0);
  await settled(page);
  const told = await sweep(page, 8, 4);
  assert.ok(told.length > 3, `${told.length} points have something`);
  const values = told.map(({ value }) => Number(value.replace('field = ', '').replace('−', '-')));
  assert.ok(values.every((value) => value >= -0.45 && value <= 0.75) && new Set(values).size > 2, String(values));
  assert.ok(told.every(({ position: [x] }) => Math.abs(x - 3) < 0.02), JSON.stringify(told));
}, withProbe('&clip=1,0,0,3', { alpha: 0, beta: 0, box: 0 }));

onPage('tells the values of channels beside it, as soon as they are there', async (page) => {
  const others = () => page.textContent('#probe-others');
  const told = await sweep(page, 3, 3);
  assert.ok(told.length > 0);
  await page.waitForFunction(() => document.querySelector('#probe-others').textContent === 'heat = 2.5 K');
  await page.evaluate(() => window.intervale.set({ colorBy: 'value', channel: 'heat' }));
  await page.waitForFunction(() => document.querySelector('#probe-others').textContent.startsWith('field = '));
  const { value: fieldValue } = told.at(-1);
  assert.match(await others(), /^field = [−0-9.]+$/);
  assert.match(fieldValue, /^field = /);
}, { ...withProbe(''), hash: '#data=any&show=probe' });

onPage('a tap tells what is there, a finger that moves does not', async (page) => {
  await page.evaluate(() => (window.intervale.canvas.setPointerCapture = () => {}));
  const touch = (type, x, y) => page.evaluate(([kind, clientX, clientY]) => {
    window.intervale.canvas.dispatchEvent(new PointerEvent(kind, { pointerId: 1, clientX, clientY, pointerType: 'touch', bubbles: true }));
  }, [type, x, y]);
  const { x, y, width, height } = await page.locator('#canvas').boundingBox();
  const middle = [x + width / 2, y + height / 2];
  await touch('pointerdown', ...middle);
  await touch('pointermove', middle[0] + 60, middle[1]);
  await touch('pointerup', middle[0] + 60, middle[1]);
  await settled(page);
  assert.equal(await label(page), null);
  await touch('pointerdown', ...middle);
  await touch('pointerup', ...middle);
  await page.waitForSelector('#probe-label:not([hidden])');
  assert.match((await label(page))[0], /^field = −?0?\.?\d+/);
}, withProbe(''));
