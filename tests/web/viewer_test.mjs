// The viewer in a real browser, against a real server.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, describe, test } from 'node:test';

import {
  difference,
  digestOf,
  drawn,
  eventually,
  fetched,
  kBlock,
  kBuckyball,
  kGyroid,
  killServers,
  launch,
  makeData,
  matches,
  open,
  pixels,
  progressOf,
  serve,
  set,
  settled,
  surfaceShares,
  throttledProxy,
  vtkArray,
} from './support.mjs';

const kEverything = { min: [-100, -100, -100], max: [100, 100, 100] };
const kCamera = 'eye=2.6,-3.2,2.2&at=0,0,0&up=0,0,1';

let data;
let server;
let browser;
before(async () => {
  data = makeData(kBuckyball, kGyroid, kBlock);
  server = await serve(data);
  browser = await launch();
});
after(async () => {
  await browser.close();
  killServers(); // also those that failed tests have left
});

// The thickness at a grid of points of the picture, from the colours of the legend. x and y are relative to the
// picture's centre, in halves of its height, y up. most: the thickness at the end of the legend; box: of the data.
async function measuredThickness(page) {
  return page.evaluate(async () => {
    const legend = document.getElementById('legend-ramp');
    const ramp = legend.getContext('2d').getImageData(0, 0, legend.width, 1).data;
    const most = parseFloat(document.getElementById('legend-high').textContent);
    const bitmap = await createImageBitmap(await window.intervale.photograph());
    const { width, height } = bitmap;
    const context = new OffscreenCanvas(width, height).getContext('2d');
    context.drawImage(bitmap, 0, 0);
    const picture = context.getImageData(0, 0, width, height).data;
    const background = [...picture.slice(0, 3)];
    const distance = (a, i, b, j) => Math.hypot(a[i] - b[j], a[i + 1] - b[j + 1], a[i + 2] - b[j + 2]);
    const points = [];
    for (let v = 4; v < height; v += 13) {
      for (let u = 4; u < width; u += 13) {
        const at = 4 * (v * width + u);
        let best = 0;
        for (let k = 4; k < ramp.length; k += 4) if (distance(picture, at, ramp, k) < distance(picture, at, ramp, best)) best = k;
        const isEmpty = distance(picture, at, background, 0) < 2;
        const thickness = isEmpty ? 0 : (best / 4 / (ramp.length / 4 - 1)) * most;
        points.push({ x: (2 * u + 1 - width) / height, y: (height - 2 * v - 1) / height, thickness });
      }
    }
    const { dims, affine } = window.intervale.live.dataset; // axes parallel to the world's
    return { points, most, box: { min: [3, 7, 11].map((k) => affine[k]), max: [3, 7, 11].map((k, i) => affine[k] + (dims[i] - 1) * affine[5 * i]) } };
  });
}

// The length within the box of the ray through such a point.
function rayLength(box, { eye, lookAt, up, fov }, x, y) {
  const sub = (a, b) => a.map((v, k) => v - b[k]);
  const unit = (a) => a.map((v) => v / Math.hypot(...a));
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const ahead = unit(sub(lookAt, eye)), right = unit(cross(ahead, up)), above = cross(right, ahead), scale = Math.tan((fov * Math.PI) / 360);
  const ray = unit(ahead.map((v, k) => v + scale * (x * right[k] + y * above[k])));
  let [near, far] = [0, Infinity];
  for (let k = 0; k < 3; ++k) {
    const [a, b] = [(box.min[k] - eye[k]) / ray[k], (box.max[k] - eye[k]) / ray[k]];
    near = Math.max(near, Math.min(a, b));
    far = Math.min(far, Math.max(a, b));
  }
  return Math.max(0, far - near);
}

// Waits until the status line says so: it shows what the page knows ten times a second at most.
const statusIs = (page, text) => page.waitForFunction((text) => document.querySelector('#progress-text').textContent === text, text);

// Runs a test on a refined page of the buckyball. Fails also if the page has errors.
async function withPage(hash, options, body) {
  const { page, errors, close } = await open(browser, `${server.url}#data=buckyball&${hash}`, options);
  try {
    await settled(page);
    await body(page);
    assert.deepEqual(errors, []);
  } finally {
    await close();
  }
}

describe('The page', () => {
  test('has a strict policy, is compressed, and refines to full detail without errors', async () => {
    const answer = await fetch(server.url);
    const policy = answer.headers.get('content-security-policy');
    assert.match(policy, /default-src 'none'/);
    assert.doesNotMatch(policy, /'unsafe-eval'|'unsafe-inline'/);
    const { page, errors, downloaded, close } = await open(browser, server.url);
    await settled(page);
    await statusIs(page, 'Done for this view');
    const size = downloaded();
    assert.ok(size > 200_000 && size <= 400_000, `${size} bytes are downloaded before data`);
    assert.deepEqual(errors, []);
    await close();
  });

  test('tells the server what its surfaces hide, if they hide anything', async () => {
    const changes = async () => Number(/^intervale_view_change_seconds_count (\d+)/m.exec(await (await fetch(new URL('/metrics', server.url))).text())[1]);
    // Views that are answered after the first one, while the page opens over a slow line.
    const line = await throttledProxy(server.port, 20_000);
    const opened = async (hash) => {
      const before = await changes();
      const { page, close } = await open(browser, `http://127.0.0.1:${line}/#data=buckyball${hash}`);
      await settled(page);
      await close();
      return (await changes()) - before;
    };
    const opaque = await opened('');
    for (const seen of ['&alpha=3a6ea5,0.5', '&clip=0,0,1,0']) assert.ok((await opened(seen)) < opaque, `${seen}, ${opaque}`);
  });

  test('has the same mesh as the native client, for the whole data set and for a view', async () => {
    await withPage('', {}, async (page) => {
      const { view, width, height } = await page.evaluate(() => {
        const { canvas } = window.intervale;
        const eye = [2.5, -3.25, 2.125];
        window.intervale.set({ pose: { eye, lookAt: [0, 0, 0], up: [0, 0, 1], fov: 30 } });
        return { view: eye, width: canvas.width, height: canvas.height };
      });
      await set(page, { pixelError: 2 });
      // In a new page: this one has received updates for earlier views as well.
      const hash = await page.evaluate(() => location.hash);
      const other = await open(browser, server.url + hash);
      await settled(other.page);
      const part = await digestOf(other.page);
      const native = fetched(server, 'buckyball', '--eye', ...view.map(String), '--look-at', '0', '0', '0', '--up', '0', '0', '1', '--fov', '30',
        '--viewport', String(width), String(height), '--pixel-error', '2');
      assert.equal(part.updates, native.updates);
      assert.equal(part.digest, native.digest);
      await other.close();
      await set(page, { region: kEverything });
      const all = await digestOf(page);
      assert.equal(all.digest, fetched(server, 'buckyball').digest);
    });
  });

  test('keeps its state in the address', async () => {
    await withPage(`${kCamera}&px=4&clip=1,0,0,0.25&show=wireframe&alpha=ff0000,0.5`, {}, async (page) => {
      const state = await page.evaluate(() => window.intervale.state);
      assert.equal(state.pixelError, 4);
      assert.deepEqual(state.clip, { normal: [1, 0, 0], offset: 0.25 });
      assert.equal(state.wireframe, true);
      assert.deepEqual(state.alpha, { color: '#ff0000', opacity: 0.5 });
      await set(page, { pixelError: 2, levels: true });
      const hash = await page.evaluate(() => location.hash);
      const copy = await open(browser, server.url + hash);
      await settled(copy.page);
      assert.deepEqual(await copy.page.evaluate(() => window.intervale.state), await page.evaluate(() => window.intervale.state));
      await copy.close();
    });
  });
});

describe('Pictures', () => {
  const size = { width: 480, height: 400 };
  test('show the surfaces', () =>
    withPage(kCamera, size, async (page) => {
      const { alpha, beta } = surfaceShares(await matches(page, 'surfaces'));
      assert.ok(alpha > 0.05 && beta < 0.01);
    }));
  test('show the interior where a plane cuts the solid', () =>
    withPage(`${kCamera}&clip=0,-1,0,0`, size, async (page) => {
      await page.waitForFunction(() => window.intervale.stats.capTriangles > 100);
      await drawn(page);
      const { interior } = surfaceShares(await matches(page, 'clip'));
      assert.ok(interior > 0.01, `${interior}`);
    }));
  test('show shrunken tetrahedra', () =>
    withPage(`${kCamera}&roi=-0.5,-1,-0.5,0.5,0,0.5&show=tets&shrink=0.7&px=4`, size, async (page) => {
      await page.waitForFunction(() => window.intervale.stats.tets > 100);
      await drawn(page);
      await matches(page, 'tets');
    }));
  test('show thickness', () => withPage(`${kCamera}&show=thickness`, size, (page) => matches(page, 'thickness')));
  test('show the thickness of a block along each ray', async () => {
    const { page, errors, close } = await open(browser, `${server.url}#data=block&eye=5,-7,4&at=0.1,0,0&up=0,0,1&fov=40&show=thickness`, size);
    await settled(page);
    await page.waitForFunction(() => !document.getElementById('legend').hidden && parseFloat(document.getElementById('legend-high').textContent) > 1);
    await drawn(page);
    const { points, most, box } = await measuredThickness(page);
    const { pose } = await page.evaluate(() => window.intervale.state);
    let hit = 0;
    for (const { x, y, thickness } of points) {
      const expected = rayLength(box, pose, x, y);
      if (expected > 0 && expected < 0.02 * most) continue; // blended with the background
      if (expected > 0) ++hit;
      assert.ok(Math.abs(thickness - expected) < 0.02 * most, `${thickness} instead of ${expected} at ${x}, ${y}, of ${most}`);
    }
    assert.ok(hit > 20 && hit < points.length - 20, `${hit} of ${points.length} rays`);
    assert.deepEqual(errors, []);
    await close();
  });
  test('show a region refined while the rest is coarse', () =>
    withPage(`${kCamera}&roi=0,-1,-1,1,1,1&show=wireframe`, size, async (page) => {
      await matches(page, 'region');
      const { updates } = await progressOf(page);
      assert.ok(updates < 0.8 * (await page.evaluate(() => window.intervale.live.dataset.updates)));
    }));
});

describe('Controls', () => {
  for (const [id, isOn] of [
    ['clip', (page) => page.evaluate(() => window.intervale.state.clip !== null)],
    ['thickness', (page) => page.evaluate(() => window.intervale.state.thickness)],
    ['wireframe', (page) => page.evaluate(() => window.intervale.state.wireframe)],
    ['levels', (page) => page.evaluate(() => window.intervale.state.levels)],
  ]) {
    test(`${id} changes the picture, and switched off restores it`, () =>
      withPage(kCamera, {}, async (page) => {
        const first = await pixels(page);
        const toggle = async () => {
          await page.locator(`label:has(#${id})`).click();
          await settled(page);
        };
        await toggle();
        assert.ok(await isOn(page));
        const { mean } = difference(first, await pixels(page));
        assert.ok(mean > 0.5, `${mean}`);
        await toggle();
        assert.ok(!(await isOn(page)));
        const back = difference(first, await pixels(page));
        assert.ok(back.mean < 0.5, `${back.mean}`);
      }));
  }

  test('colours of values show on surfaces and cuts, with a bar', () =>
    withPage(`${kCamera}&clip=1,0,0,0.25`, {}, async (page) => {
      const colorBy = async (name) => {
        await page.selectOption('#color-by', name);
        await settled(page);
        return pixels(page);
      };
      const first = await pixels(page);
      const { mean } = difference(first, await colorBy('value'));
      assert.ok(mean > 0.5, `${mean}`);
      await eventually(async () => assert.deepEqual(await page.$$eval('#palette option', (options) => options.map(({ value }) => value)), ['viridis', 'cividis', 'inferno', 'ice', 'grey']));
      await eventually(async () => assert.deepEqual(await page.$$eval('#legend .ends span', (spans) => spans.map(({ textContent }) => textContent)), ['128', '158', '188']));
      const back = difference(first, await colorBy('surface'));
      assert.ok(back.mean < 0.5, `${back.mean}`);
    }));

  test('keys have the effects of the switches', () =>
    withPage(kCamera, {}, async (page) => {
      await page.focus('#canvas');
      for (const [key, name] of [['c', 'clip'], ['g', 'region'], ['t', 'thickness'], ['w', 'wireframe'], ['l', 'levels']]) {
        await page.keyboard.press(key);
        assert.ok(await page.evaluate((name) => Boolean(window.intervale.state[name]), name), name);
        await page.keyboard.press(key);
        assert.ok(!(await page.evaluate((name) => Boolean(window.intervale.state[name]), name)), name);
      }
      const pose = () => page.evaluate(() => JSON.stringify(window.intervale.state.pose));
      const first = await pose();
      for (const key of ['ArrowLeft', 'ArrowUp', '+', '-', 'Shift+ArrowLeft']) {
        const before = await pose();
        await page.keyboard.press(key);
        await eventually(async () => assert.notEqual(await pose(), before, key));
      }
      await page.keyboard.press('r');
      await eventually(async () => assert.notEqual(await pose(), first));
      await page.keyboard.press('h');
      await eventually(async () => assert.ok(await page.isVisible('#help-dialog')));
      await page.keyboard.press('Escape');
    }));

  test('dragging rotates, the wheel zooms, and closer views have more updates', () =>
    withPage('px=4', {}, async (page) => {
      const before = await progressOf(page);
      const box = await page.locator('#canvas').boundingBox();
      const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
      await page.mouse.move(x, y);
      await page.mouse.down();
      await page.mouse.move(x + 120, y + 40, { steps: 6 });
      await page.mouse.up();
      await eventually(async () => assert.notEqual(await page.evaluate(() => window.intervale.state.pose), null));
      for (let k = 0; k < 6; ++k) {
        await page.mouse.wheel(0, -240);
        await page.waitForTimeout(60);
      }
      await eventually(async () => {
        await settled(page);
        assert.ok((await progressOf(page)).updates > before.updates);
      });
    }));

  test('the screen-space error and the budget of tetrahedra limit the mesh', () =>
    withPage('px=8', {}, async (page) => {
      const coarse = await progressOf(page);
      await set(page, { pixelError: 0.5 });
      const fine = await progressOf(page);
      assert.ok(fine.updates > 2 * coarse.updates);
      // No progress report may exceed the budget.
      await page.evaluate(() => {
        window.mostTets = 0;
        window.watching = (async () => {
          while (window.watching !== null) window.mostTets = Math.max(window.mostTets, (await window.intervale.next('progress')).progress.tets);
        })();
      });
      await set(page, { maxTets: 20_000 });
      await page.evaluate(() => (window.mostTets = 0));
      await set(page, { region: kEverything });
      assert.ok((await page.evaluate(() => window.mostTets)) <= 20_000);
      assert.ok((await progressOf(page)).tets > 10_000);
      await set(page, { maxTets: null });
      assert.equal((await progressOf(page)).updatesShown, (await progressOf(page)).updates);
    }));

  test('the memory budget limits the updates, and the page says so', () =>
    withPage('mb=1', {}, async (page) => {
      await set(page, { region: kEverything });
      const progress = await progressOf(page);
      assert.ok(progress.full);
      assert.ok(progress.updates <= 1e6 / 30, `${progress.updates}`);
      await statusIs(page, 'Done: memory limit reached');
    }));

  test('full screen, the theme and copying the link work', () =>
    withPage(kCamera, {}, async (page) => {
      await page.click('#fullscreen');
      await page.waitForFunction(() => document.fullscreenElement !== null);
      await page.click('#fullscreen');
      await page.waitForFunction(() => document.fullscreenElement === null);
      const background = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
      const before = await background();
      await page.click('#theme');
      assert.notEqual(await background(), before);
      await page.context().grantPermissions(['clipboard-read', 'clipboard-write']);
      await page.click('#copy-link');
      await page.waitForFunction(async () => (await navigator.clipboard.readText()) === location.href);
    }));

  test('choosing another data set opens it and changes the address', () =>
    withPage('', {}, async (page) => {
      await page.getByText('gyroid').click();
      await page.waitForFunction(() => window.intervale.live.dataset?.name === 'gyroid');
      await settled(page);
      assert.match(await page.evaluate(() => location.hash), /data=gyroid/);
    }));

  test('pictures and meshes are saved', () =>
    withPage('px=4', {}, async (page) => {
      const save = async (id) => {
        const [download] = await Promise.all([page.waitForEvent('download'), page.click(`#save-${id}`)]);
        return { name: download.suggestedFilename(), bytes: readFileSync(await download.path()) };
      };
      const { tets, triangles } = await progressOf(page);
      const picture = await save('picture');
      assert.match(picture.name, /^buckyball.*\.png$/);
      assert.equal(picture.bytes.subarray(1, 4).toString(), 'PNG');
      const vtu = await save('vtu');
      assert.match(vtu.bytes.subarray(0, 2000).toString('latin1'), new RegExp(`NumberOfCells="${tets}"`));
      const types = vtkArray(vtu.bytes, 'types');
      assert.equal(types.length, tets);
      assert.ok(types.every((type) => type === 10));
      assert.equal(vtkArray(vtu.bytes, 'connectivity').length, tets * 4 * 8);
      const stl = await save('stl');
      assert.equal(stl.bytes.readUInt32LE(80), triangles);
      const glb = await save('glb');
      assert.equal(glb.bytes.subarray(0, 4).toString(), 'glTF');
    }));
});

describe('Sizes', () => {
  for (const [name, width, height, scheme] of [['phone', 360, 740, 'dark'], ['laptop', 1280, 800, 'light'], ['4k', 3840, 2160, 'dark']]) {
    test(`${width} by ${height}`, () =>
      withPage('px=8', { width, height, colorScheme: scheme }, async (page) => {
        const { scroll, canvas } = await page.evaluate(() => ({
          scroll: [document.documentElement.scrollWidth, document.documentElement.scrollHeight],
          canvas: document.getElementById('canvas').getBoundingClientRect().toJSON(),
        }));
        assert.ok(scroll[0] <= width && scroll[1] <= height, `the page scrolls: ${scroll}`);
        assert.ok(canvas.width * canvas.height > 0.4 * width * height);
        if (width < 600) await page.click('#panel-toggle');
        await page.locator('#save-glb').scrollIntoViewIfNeeded();
        const button = await page.locator('#save-glb').boundingBox();
        assert.ok(button.x >= 0 && button.x + button.width <= width && button.y + button.height <= height, JSON.stringify(button));
        assert.ok(button.height >= 24, 'large enough for touch');
        await page.screenshot({ path: `${process.env.INTERVALE_WEB_OUT}/size-${name}.png` });
      }));
  }
});
