// The controls of the ranges, of one and of several, in a real browser with a fake worker.
import assert from 'node:assert/strict';
import { decode, difference, eventually, pixels, share } from './browser.mjs';
import { changesPicture, openPage, recordRequests, refined, settled, sharedPages, state } from './fake_server.mjs';

const shared = sharedPages();
const { onPage } = shared;
const kSmall = { width: 800, height: 400 };
const kAny = { ...kSmall, hash: '#data=any' }; // of every range
const kTwo = { ...kSmall, hash: '#data=any&range=-1.2,-0.6,e69f00,1&range=0.4,1.2,009e73,1' };

const rangesOf = async (page) => (await state(page)).ranges.map(({ range }) => range);
const shows = (page, ...ranges) => page.waitForFunction((wanted) => {
  const last = window.requests.findLast(({ type }) => type === 'view')?.view.ranges;
  return JSON.stringify(last) === wanted;
}, JSON.stringify(ranges));
async function chartOf(page) {
  await page.locator('#histogram').scrollIntoViewIfNeeded();
  return page.locator('#histogram').boundingBox();
}
const isOrange = (r, g, b) => r > b + 60 && g > b + 30 && r > g;
const isGreen = (r, g, b) => g > r + 60 && g > b;

onPage('of every range, the range is chosen by two numbers, and stands in the address', async (page) => {
  await eventually(async () => assert.equal(await page.isVisible('#range-section'), false, 'this one has one range'));
  await recordRequests(page);
  await page.getByRole('radio', { name: 'any' }).check();
  await shows(page, [0, 1.5]);
  await eventually(async () => assert.equal(await page.inputValue('#range-high'), '1.5'));
  await page.fill('#range-low', '-0.25');
  await page.press('#range-low', 'Enter');
  await shows(page, [-0.25, 1.5]);
  await eventually(async () => assert.equal(await page.textContent('#alpha-value'), 'field = −0.25'));
  await page.fill('#range-high', '');
  await page.press('#range-high', 'Enter');
  await shows(page, [-0.25, Infinity]);
  await page.waitForFunction(() => location.hash.includes('range=-0.25,inf'));
}, kSmall);

onPage('of every range, handles on the histogram show what is there, and ask for the rest when they rest', async (page) => {
  await page.getByRole('radio', { name: 'any' }).check();
  await page.waitForSelector('#histogram:not([hidden])');
  await eventually(async () => assert.equal(await page.textContent('#range-volume'), 'encloses 55,296 units³, 50.0 % of the box'));
  await recordRequests(page);
  const [handle, chart] = [page.locator('#range-handle-low'), await chartOf(page)];
  const at = async (share) => page.mouse.move(chart.x + share * chart.width, chart.y + chart.height / 2);
  await at(0.5);
  await page.mouse.down();
  for (const share of [0.6, 0.7, 0.77]) await at(share);
  await eventually(async () => assert.equal(await page.inputValue('#range-low'), '0.8'));
  await page.mouse.up();
  await shows(page, [0.8, 1.5]);
  const sent = (await page.evaluate(() => window.requests)).flatMap(({ type, ranges, view }) => (ranges || view ? [[type, ...(ranges ?? view.ranges)]] : []));
  assert.deepEqual(sent.at(-1), ['view', [0.8, 1.5]]);
  assert.deepEqual(sent[0].slice(0, 1), ['preview']);
  await handle.press('Home');
  await page.waitForFunction(() => window.intervale.state.range?.[0] === -1.5);
  assert.equal(await handle.getAttribute('aria-valuenow'), '-1.5');
  await handle.press('ArrowRight');
  await page.waitForFunction(() => Math.abs(window.intervale.state.range?.[0] + 1.25) < 0.1);
}, kSmall);

onPage('ranges are added, each with a place and a colour of its own, and removed', async (page) => {
  await page.waitForSelector('#histogram:not([hidden])');
  await recordRequests(page);
  await eventually(async () => assert.equal(await page.isVisible('#range-color'), false, 'one range has its surfaces\' colours'));
  assert.equal(await page.locator('#histogram .bound:visible').count(), 2);
  await page.click('#range-add');
  await shows(page, [0, 1.5], [-1, -0.5]);
  await eventually(async () => assert.ok(await page.isHidden('#surface-styles')));
  assert.deepEqual((await state(page)).ranges.map(({ style }) => style), [{ color: '#3d7fd6', opacity: 1 }, { color: '#e69f00', opacity: 1 }]);
  for (let k = 0; k < 2; ++k) await page.click('#range-add');
  await eventually(async () => assert.equal(await page.isVisible('#range-add'), false, 'no more than four'));
  assert.equal(await page.locator('#histogram .bound:visible').count(), 8);
  assert.equal(new Set((await state(page)).ranges.map(({ style }) => style.color)).size, 4);
  const disjoint = (await rangesOf(page)).sort((a, b) => a[0] - b[0]);
  assert.ok(disjoint.every(([low, high], i) => low < high && (i === 0 || low >= disjoint[i - 1][1])), JSON.stringify(disjoint));
  await page.click('#range-remove');
  await page.click('#range2-remove');
  assert.deepEqual((await rangesOf(page))[0], [-1, -0.5], 'the others stay');
  await page.click('#range2-remove');
  await shows(page, [-1, -0.5]);
  assert.deepEqual((await state(page)).ranges, []);
  await eventually(async () => assert.ok((await page.isVisible('#surface-styles')) && (await page.isVisible('#range-add'))));
  await eventually(async () => assert.equal(await page.inputValue('#range-low'), '-1'));
}, kAny);

onPage('a handle and the fields of one range leave the others as they are', async (page) => {
  await page.waitForSelector('#histogram:not([hidden])');
  await recordRequests(page);
  await eventually(async () => assert.equal(await page.textContent('#range2-volume'), 'encloses 29,491 units³, 26.7 % of the box'));
  const chart = await chartOf(page);
  const at = async (value) => page.mouse.move(chart.x + ((value + 1.5) / 3) * chart.width, chart.y + chart.height / 2);
  await at(0.4);
  await page.mouse.down();
  await at(0.6);
  await at(0.75);
  await page.waitForFunction(() => window.requests.some(({ type }) => type === 'preview'));
  const previews = (await page.evaluate(() => window.requests)).filter(({ type }) => type === 'preview');
  assert.ok(previews.every(({ ranges: [first, [low, high]] }) => String(first) === '-1.2,-0.6' && low > 0.4 && high === 1.2));
  await page.mouse.up();
  await page.waitForFunction(() => window.intervale.state.ranges[1].range[0] > 0.7);
  const [first, second] = await rangesOf(page);
  assert.deepEqual(first, [-1.2, -0.6]);
  assert.equal(second[1], 1.2);
  await page.fill('#range2-high', '');
  await page.press('#range2-high', 'Enter');
  await shows(page, [-1.2, -0.6], [second[0], Infinity]);
  await page.fill('#range-low', '-0.5');
  await page.press('#range-low', 'Enter');
  await shows(page, [-0.5, -0.5], [second[0], Infinity]);
}, kTwo);

onPage('each range has its colour and opacity, in surfaces, cuts and shrunken tetrahedra', async (page) => {
  const seen = async (what) => {
    await settled(page);
    const picture = await pixels(page);
    assert.ok(share(picture, isOrange) > 0.01 && share(picture, isGreen) > 0.01, what);
    return picture;
  };
  await seen('surfaces');
  for (const [key, what] of [['c', 'cut'], ['s', 'tets']]) {
    for (const id of ['range', 'range2']) await page.fill(`#${id}-opacity`, '0');
    await page.keyboard.press(key);
    await page.waitForFunction((name) => window.intervale.stats[name] > 0, { cut: 'capTriangles', tets: 'tets' }[what]);
    await seen(what);
    await page.keyboard.press(key);
    await settled(page);
  }
  const empty = await pixels(page);
  assert.equal(share(empty, isOrange) + share(empty, isGreen), 0, 'nothing is to be seen');
  await page.fill('#range2-opacity', '0.5');
  await settled(page);
  const translucent = await pixels(page);
  assert.ok(share(translucent, isOrange) === 0 && share(translucent, (r, g, b) => g > r + 15) > 0.02, 'one of them');
  await page.fill('#range-opacity', '1');
  await changesPicture(page, () => page.fill('#range-color', '#d02020'));
  assert.deepEqual((await state(page)).ranges.map(({ style }) => style), [{ color: '#d02020', opacity: 1 }, { color: '#009e73', opacity: 0.5 }]);
}, kTwo);

onPage('the address restores ranges with their colours; values span all of them', async (page) => {
  await page.fill('#range2-opacity', '0.25');
  await page.fill('#range-color', '#336699');
  await page.selectOption('#color-by', 'value');
  await page.waitForFunction(() => location.hash.includes('range=-1.2,-0.6,336699,1&range=0.4,1.2,009e73,0.25&color=value'));
  await settled(page);
  await eventually(async () => assert.deepEqual(await page.$$eval('#legend .ends span', (spans) => spans.map((span) => span.textContent)), ['−1.2', '0', '1.2']));
  const other = await openPage(shared.browser, page.url(), kSmall);
  await refined(other);
  assert.deepEqual((await state(other)).ranges, (await state(page)).ranges);
  await other.getByRole('radio', { name: 'gyroid' }).check();
  assert.deepEqual([(await state(other)).ranges, (await state(other)).range], [[], null], 'another data set has its own range');
  await other.context().close();
}, kTwo);

onPage('where one of several ranges is removed, the others keep their colours until they are drawn anew', async (page) => {
  await settled(page);
  const before = await pixels(page);
  const photograph = () => page.evaluate(async () => {
    document.querySelector('#range-remove').click();
    return new Uint8Array(await (await window.intervale.photograph()).arrayBuffer()).reduce((text, byte) => text + String.fromCharCode(byte), '');
  });
  const atOnce = await decode(page, Buffer.from(await photograph(), 'latin1').toString('base64'));
  assert.equal(difference(before, atOnce).share, 0);
  assert.equal((await state(page)).ranges.length, 2);
  for (const end = Date.now() + 15_000; share(await pixels(page), isOrange) > 0.001 && Date.now() < end; ) await settled(page);
  const after = await pixels(page);
  assert.equal(share(after, isOrange), 0, 'the first is gone');
  assert.ok(share(after, isGreen) > 0.01, 'the second is still green');
}, { ...kSmall, hash: `${kTwo.hash}&range=0,0.2,cc79a7,1` });
