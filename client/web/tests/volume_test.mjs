// Volume rendering and its controls, in a real browser with a fake worker, whose first palette goes from blue to red.
import assert from 'node:assert/strict';
import { difference, eventually, pixels, share } from './browser.mjs';
import { changesPicture, recordRequests, settled, sharedPages, state } from './fake_server.mjs';

const { onPage } = sharedPages();
const kSmall = { width: 780, height: 260 };
const kDense = 'render=volume&opacity=-1.5:0.9,1.5:0.9';
const isRed = (r, g, b) => r > g + 60 && r > b + 60;
const isBlue = (r, g, b) => b > r + 60 && b > g + 60;
const kEmpty = [{ value: 0, opacity: 0 }];

const drawn = (page) => page.waitForFunction(() => window.intervale.stats.volumeTets > 100).then(() => settled(page));
const curve = async (page) => (await state(page)).opacity?.map(({ value, opacity }) => [value, opacity]) ?? null;
const strip = (page) => page.locator('#opacity').boundingBox();

onPage('a switch and a key turn it on and off; it asks for the inside, and of colours for those of values', async (page) => {
  await drawn(page);
  await recordRequests(page);
  const asks = (uniform, maxTets) => page.waitForFunction((wanted) => {
    const view = window.requests.findLast(({ type }) => type === 'view')?.view;
    return view && JSON.stringify([view.uniform, view.maxTets]) === wanted;
  }, JSON.stringify([uniform, maxTets]));
  await eventually(async () => assert.ok((await page.isVisible('#legend')) && (await page.isVisible('#palette')) && (await page.isVisible('#opacity'))));
  await changesPicture(page, () => page.keyboard.press('o'), 0.05);
  await asks(false, null);
  await eventually(async () => assert.ok(!(await page.isVisible('#legend')) && !(await page.isVisible('#palette')) && !(await page.isVisible('#opacity'))));
  await page.keyboard.press('t');
  await page.click('#volume');
  assert.deepEqual([(await state(page)).render, (await state(page)).thickness], ['volume', false]);
  await asks(true, 2e6);
  await page.keyboard.press('t');
  assert.deepEqual([(await state(page)).render, (await state(page)).thickness], ['surface', true], 'thickness takes its place');
  assert.ok(!(await page.isChecked('#volume')));
  await asks(false, null);
  assert.deepEqual(await page.evaluate(() => window.requests.filter(({ type }) => type === 'volume').map(({ wanted }) => wanted)), [false, true, false]);
}, { ...kSmall, hash: '#data=any&render=volume' });

onPage('opacity 0 shows the background', async (page) => {
  await drawn(page);
  assert.ok(share(await pixels(page), (r, g, b) => isRed(r, g, b) || isBlue(r, g, b)) > 0.1);
  await page.evaluate((opacity) => window.intervale.set({ opacity }), kEmpty);
  await settled(page);
  const empty = await pixels(page);
  assert.equal(share(empty, (r, g, b) => r === empty.data[0] && g === empty.data[1] && b === empty.data[2]), 1);
}, { ...kSmall, hash: `#data=gyroid&${kDense}` });

onPage('what is nearest is seen, from both sides, and behind a clip plane what it uncovers', async (page) => {
  // Values rise from blue to red; only the ends are opaque, so each side of a wall of the gyroid has its colour.
  await drawn(page);
  const shares = async () => {
    const picture = await pixels(page);
    return [share(picture, isRed), share(picture, isBlue)];
  };
  const [red, blue] = await shares();
  assert.ok(red > 0.02 && blue > 0.02, `${red} ${blue}`);
  await changesPicture(page, () => page.evaluate(() => window.intervale.set({ clip: { normal: [1, 0, 0], offset: 0 } })), 0.02);
  await changesPicture(page, () => page.evaluate(() => window.intervale.set({ pose: { eye: [0, 150, 20], lookAt: [0, 0, 0], up: [0, 0, 1], fov: 30 } })), 0.02);
  await page.evaluate(() => window.intervale.set({ clip: { normal: [1, 0, 0], offset: -25 } }));
  await eventually(async () => assert.deepEqual(await shares(), [0, 0], 'all is cut away'));
}, { ...kSmall, hash: '#data=gyroid&render=volume&opacity=-0.45:0.95,-0.2:0,0.5:0,0.75:0.95' });

onPage('where ranges overlap, each part counts once', async (page) => {
  await drawn(page);
  const overlapping = await pixels(page);
  const { volumeTets } = await page.evaluate(() => ({ ...window.intervale.stats }));
  await page.evaluate(() => window.intervale.set({ ranges: [], range: [-0.45, 0.75] })); // the fake worker's one mesh
  await page.waitForFunction((before) => window.intervale.stats.volumeTets < before, volumeTets);
  await settled(page);
  const { mean, share: other } = difference(overlapping, await pixels(page));
  assert.ok(mean < 2 && other < 0.02, `${mean} ${other}`);
}, { ...kSmall, hash: '#data=any&render=volume&span=-0.45,0.75&opacity=-0.45:0.05,0.75:0.3&range=-0.45,0.3,e69f00,1&range=-0.1,0.75,009e73,1' });

onPage('points of the opacity are dragged, added and removed, and reset', async (page) => {
  await drawn(page);
  assert.equal(await page.locator('.opacity-point').count(), 2);
  const { x, y, width, height } = await strip(page);
  const at = (across, up) => [x + across * width, y + (1 - up) * height];
  await page.mouse.dblclick(...at(0.6, 0.5));
  const added = await curve(page);
  assert.deepEqual([added.length, added[0], added[2]], [3, [0, 0], [1.5, 0.3]]);
  assert.ok(Math.abs(added[1][0] - 0.3) < 0.02 && Math.abs(added[1][1] - 0.25) < 0.03, `the axis is that of the histogram: ${added[1]}`);
  await changesPicture(page, async () => {
    await page.mouse.move(...at(0.6, 0.5));
    await page.mouse.down();
    await page.mouse.move(...at(0.7, 0.9), { steps: 3 });
    await page.mouse.up();
  });
  const [value, opacity] = (await curve(page))[1];
  assert.ok(Math.abs(value - 0.6) < 0.02 && Math.abs(opacity - 0.81) < 0.03, `${value} ${opacity}`);
  await page.waitForFunction(() => location.hash.includes('opacity=0:0,0.') && location.hash.includes('render=volume'));
  await page.focus('#opacity-point-1');
  await page.keyboard.press('ArrowUp');
  assert.ok((await curve(page))[0][1] > 0 && (await curve(page))[0][0] === 0);
  await page.keyboard.press('ArrowRight');
  assert.ok((await curve(page))[0][0] > 0);
  await page.keyboard.press('Enter');
  assert.equal((await curve(page)).length, 4);
  await page.keyboard.press('Delete');
  assert.equal((await curve(page)).length, 3);
  assert.equal(await page.evaluate(() => document.activeElement.id), 'opacity-point-1');
  await page.click('#opacity-reset');
  assert.equal(await curve(page), null);
}, { width: 800, height: 720, hash: '#data=any&render=volume' });

onPage('the address restores it', async (page) => {
  await drawn(page);
  assert.deepEqual(await curve(page), [[-1, 0.125], [0.5, 1]]);
  assert.equal((await state(page)).render, 'volume');
  assert.ok(await page.isChecked('#volume'));
  await eventually(async () => assert.equal(await page.inputValue('#palette'), 'green'));
}, { ...kSmall, hash: '#data=gyroid&render=volume&opacity=-1:0.125,0.5:1&palette=green' });
