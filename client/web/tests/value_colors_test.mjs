// Colours of the field's values, in a real browser with a fake worker, whose palettes go from blue to red (warm), and
// from black to green.
import assert from 'node:assert/strict';
import { difference, eventually, pixels, share } from './browser.mjs';
import { recordRequests, settled, sharedPages, state } from './fake_server.mjs';

const { onPage } = sharedPages();

// Until this share of the picture satisfies a predicate of red, green and blue, for up to 15 s.
async function becomes(page, least, predicate, what) {
  let found = 0;
  for (const end = Date.now() + 15_000; found < least && Date.now() < end; ) {
    await settled(page);
    found = share(await pixels(page), predicate);
  }
  assert.ok(found >= least, `${found} of the picture is ${what}`);
}
const isRed = (r, g, b) => r > g + 60 && r > b + 60;
const isBlue = (r, g, b) => b > r + 60 && b > g + 60;
const isGreen = (r, g, b) => g > r + 60 && g > b + 60;
const isPurple = (r, g, b) => Math.min(r, b) > g + 40 && Math.abs(r - b) < 70;
const labels = (page) => page.$$eval('#legend .ends span', (spans) => spans.map((span) => span.textContent));
async function fill(page, field, text) {
  await page.fill(field, text);
  await page.press(field, 'Enter');
}

onPage('colours show values, with a bar; the surfaces have theirs again', async (page) => {
  await settled(page);
  const plain = await pixels(page);
  await eventually(async () => assert.ok(!(await page.isVisible('#value-controls')) && !(await page.isVisible('#legend'))));
  await page.selectOption('#color-by', 'value');
  await becomes(page, 0.02, isBlue, 'blue: the lower surface');
  await becomes(page, 0.02, isRed, 'red: the upper surface');
  await eventually(async () => assert.deepEqual(await labels(page), ['−0.45', '0.15', '0.75']));
  await eventually(async () => assert.equal(await page.textContent('#legend-title'), 'Field'));
  await page.selectOption('#palette', 'green');
  await becomes(page, 0.02, isGreen, 'green');
  await page.selectOption('#color-by', 'surface');
  await settled(page);
  assert.ok(difference(plain, await pixels(page)).share < 0.001);
  await eventually(async () => assert.ok(!(await page.isVisible('#legend'))));
});

const kInvisible = ['alpha', 'beta', 'box'].map((name) => `&${name}=000000,0`).join('');
onPage('caps and shrunken tetrahedra have the colours of values between those of the surfaces', async (page) => {
  for (const [key, what] of [['c', 'the cut'], ['s', 'the tetrahedra']]) {
    assert.equal(share(await pixels(page), isPurple), 0);
    await page.keyboard.press(key);
    await becomes(page, 0.005, isPurple, `purple: ${what}`);
    await page.keyboard.press(key);
    await page.waitForFunction(() => window.intervale.stats.capTriangles + window.intervale.stats.tets === 0);
    await settled(page);
  }
}, { hash: '#data=gyroid&color=value' + kInvisible });

onPage('values beyond the span have the colours of its ends; reset restores the range', async (page) => {
  await fill(page, '#span-low', '1');
  await becomes(page, 0.1, isBlue, 'blue: all is below');
  assert.equal(share(await pixels(page), isRed), 0);
  assert.deepEqual((await state(page)).span, [1, 1], 'the other end follows');
  await fill(page, '#span-high', '-2');
  await becomes(page, 0.1, isRed, 'red: all is above');
  await eventually(async () => assert.deepEqual(await labels(page), ['−2', '−2', '−2']));
  await page.waitForFunction(() => location.hash.includes('color=value') && location.hash.includes('span=-2,-2'));
  await page.click('#span-reset');
  await eventually(async () => assert.deepEqual(await labels(page), ['−0.45', '0.15', '0.75']));
  assert.equal((await state(page)).span, null);
}, { hash: '#data=gyroid&color=value' });

onPage('the address restores colours, palette and span', async (page) => {
  await becomes(page, 0.1, isGreen, 'green');
  await eventually(async () => assert.equal(await page.inputValue('#palette'), 'green'));
  await eventually(async () => assert.equal(await page.inputValue('#span-low'), '-9'));
  await eventually(async () => assert.deepEqual(await labels(page), ['−9', '−4.5', '0']));
}, { hash: '#data=gyroid&color=value&palette=green&span=-9,0' });

onPage('the span follows the range, also while a handle moves', async (page) => {
  await page.waitForSelector('#histogram:not([hidden])');
  await eventually(async () => assert.equal(await page.inputValue('#span-low'), '0'));
  const { x, y, width } = await page.locator('#histogram').boundingBox();
  await page.evaluate(() => {
    const [handle, low] = ['range-handle-low', 'span-low'].map((id) => document.getElementById(id));
    handle.addEventListener('pointermove', () => (window.seen = [low.value, window.intervale.state.range])); // after the page
  });
  await page.mouse.move(x + width / 2, y + 20);
  await page.mouse.down();
  await page.mouse.move(x + 0.77 * width, y + 20);
  assert.deepEqual(await page.evaluate(() => window.seen), ['0.8', null]);
  await page.mouse.up();
  await page.waitForFunction(() => window.intervale.state.range?.[0] === 0.8);
  await eventually(async () => assert.equal(await page.inputValue('#span-low'), '0.8'));
}, { hash: '#data=any&color=value' });

onPage('a channel has colours, too, and is asked for', async (page) => {
  await recordRequests(page);
  const requested = (channel) => page.waitForFunction((name) => window.requests.some((r) => r.type === 'view' && r.view.channel === name), channel);
  const titled = (title) => page.waitForFunction((text) => document.getElementById('legend-title').textContent === text, title);
  await eventually(async () => assert.deepEqual(await page.$$eval('#color-by option', (options) => options.map(({ value }) => value)), ['surface', 'value', 'channel:heat']));
  await fill(page, '#span-low', '1');
  await page.selectOption('#color-by', 'channel:heat');
  await requested('heat');
  await titled('heat, K');
  await eventually(async () => assert.deepEqual(await labels(page), ['−1', '1', '3']));
  await page.waitForFunction(() => location.hash.includes('color=value') && location.hash.includes('channel=heat'));
  await page.evaluate(() => (window.requests.length = 0));
  await page.selectOption('#color-by', 'value');
  await requested(null);
  await titled('Field');
}, { hash: '#data=any&color=value' });

onPage('thickness and levels of detail take the place of values, and values theirs', async (page) => {
  for (const [key, name] of [['t', 'thickness'], ['l', 'levels']]) {
    await page.keyboard.press(key);
    assert.equal((await state(page)).colorBy, 'surface');
    await eventually(async () => assert.equal(await page.inputValue('#color-by'), 'surface'));
    await page.keyboard.press('v');
    assert.equal((await state(page)).colorBy, 'value');
    assert.equal((await state(page))[name], false);
    assert.ok(!(await page.isChecked(`#${name}`)));
  }
}, { hash: '#data=gyroid&color=value' });
