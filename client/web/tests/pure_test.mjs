// Properties of the page's pure functions: the address, cameras, planes, regions, numbers. Needs no browser.
import assert from 'node:assert/strict';
import { test } from 'node:test';

import { load } from './modules.mjs';

const kOfPackage = ['camera', 'vec', 'frame', 'preview_pace', 'ranges', 'live_mesh', 'pieces'];
const loadNamed = (name) => load(kOfPackage.includes(name) ? `/package/src/${name}.ts` : `/src/${name}.ts`);
const [
  { exclusive, fromHash, toHash, kDefaults, stylesOf }, camera, plane, values, region, format, vec, frame, { PreviewPace }, palette, opacity, ranges,
  { addressOf }, { arraysOf },
] = await Promise.all(
  ['state', 'camera', 'plane', 'range', 'region', 'format', 'vec', 'frame', 'preview_pace', 'palette', 'opacity', 'ranges', 'live_mesh', 'pieces'].map(loadNamed),
);

const seed = Number(process.env.INTERVALE_SEED ?? Date.now() % 1e6);
console.log(`seed ${seed} (INTERVALE_SEED)`);
let last = seed;
const random = (low = 0, high = 1) => {
  last = (last * 1103515245 + 12345) % 2147483648;
  return low + ((high - low) * last) / 2147483648;
};
const randomVec = (size = 100) => [0, 1, 2].map(() => random(-size, size));
const isNear = (a, b, within = 1e-6) => a.every((x, i) => Math.abs(x - b[i]) <= within * (1 + Math.abs(b[i])));
function assertNear(a, b) {
  if (typeof b === 'number') return assert.ok(Math.abs(a - b) <= 1e-6 * (1 + Math.abs(b)), `${a} is not ${b}`);
  if (typeof b !== 'object' || b === null) return assert.equal(a, b);
  assert.deepEqual(Object.keys(a), Object.keys(b));
  for (const key of Object.keys(b)) assertNear(a[key], b[key]);
}
const randomPose = () => ({ eye: randomVec(), lookAt: randomVec(), up: vec.unit(randomVec()), fov: 30 });

test('an address restores the view that it was written from', () => {
  for (let i = 0; i < 200; ++i) {
    const [a, b] = [randomVec(), randomVec()];
    const state = {
      dataset: ['buckyball', 'a b/ü&=#+', null][i % 3],
      pose: i % 2 ? { ...randomPose(), fov: 45 } : null,
      range: i % 3 && i % 4 ? [Math.min(a[0], b[0]), Math.max(a[0], b[0])] : null,
      ranges: i % 4 ? [] : Array.from({ length: 2 + (i % 3) }, (_, k) => ({ range: [random(-9, 0), random()], style: { color: `#00ff0${k}`, opacity: k / 4 } })),
      pixelError: random(0.5, 16),
      maxTets: i % 4 ? null : Math.round(random(1e4, 1e7)),
      memory: i % 5 ? null : 20,
      frameRate: [60, 0, 24.5][i % 3],
      clip: i % 3 ? { normal: vec.unit(randomVec()), offset: random(-9, 9) } : null,
      region: { min: a.map((x, d) => Math.min(x, b[d])), max: a.map((x, d) => Math.max(x, b[d])) },
      tets: i % 2 === 0,
      shrink: 0.55,
      thickness: i % 7 !== 0 && i % 3 === 0,
      wireframe: i % 2 === 1,
      probe: i % 4 === 1,
      levels: i % 7 !== 0 && i % 5 === 0,
      colorBy: i % 7 ? 'surface' : 'value',
      channel: i % 3 ? null : 'T (K)',
      palette: [null, 'grey', 'a b&'][i % 3],
      span: i % 2 ? [Math.min(a[1], b[1]), Math.max(a[1], b[1])] : null,
      render: i % 7 !== 0 && (i % 3 === 0 || i % 5 === 0) || i % 2 ? 'surface' : 'volume',
      opacity: i % 4 ? null : [{ value: -random(), opacity: 0 }, { value: 1e-9, opacity: random() }, { value: 1 + random(), opacity: 1 }],
      alpha: { color: '#012345', opacity: 0.25 },
      beta: kDefaults.beta,
      box: { color: '#ffffff', opacity: 0 },
    };
    assertNear(fromHash(toHash(state)), state);
  }
});

test('an invalid address gives the default view', () => {
  const invalid = ['#eye=1,2&at=&clip=0,0,0,1&roi=1,2,3', '#px=x&tets=NaN&mb=Infinity&alpha=red,2&show=nothing', '#%%%&&==', '#range=2,1', '#range=1', '#range=a,b', '#range=inf,inf', '#range=1,', '#range=2,1&range=3,2', '#range=1,2,red,1&range=1,2,3', '#span=2,1&color=red', '#span=-inf,1', '#eye=1,1,1&at=1,1,1'];
  for (const hash of ['', '#', ...invalid]) {
    assert.deepEqual(fromHash(hash), kDefaults, hash);
  }
  assert.equal(fromHash('#px=1e9').pixelError, 64);
  assert.equal(fromHash('#fps=-5').frameRate, 0);
  assert.equal(fromHash('#show=tets').tets, false, 'tetrahedra need a region');
});

test('a range is that of the data set, or one within it', () => {
  for (const range of [[-Infinity, 3], [2, Infinity], [-Infinity, Infinity], [0, 0], [1 / 3, 1e-9 + 1 / 3], [-1e300, 5e-324]]) {
    assert.deepEqual(fromHash(toHash({ ...kDefaults, range })).range, range);
  }
  const every = { range: [-Infinity, Infinity], values: [-1, 5], hasEveryRange: true, hasRangesWithin: true };
  const uniform = { range: [0, 4], values: [-1, 5], hasEveryRange: false, hasRangesWithin: true };
  const one = { ...uniform, hasRangesWithin: false };
  assert.deepEqual(ranges.rangeOf(every, null), [2, 5], 'the upper half');
  assert.deepEqual(ranges.rangeOf(every, [-9, 1]), [-9, 1]);
  assert.equal(ranges.rangeOf(uniform, null), null);
  assert.deepEqual(ranges.rangeOf(uniform, [-9, 1]), [0, 1]);
  assert.deepEqual(ranges.rangeOf(uniform, [7, 9]), [4, 4]);
  assert.equal(ranges.rangeOf(one, [1, 2]), null);
  assert.deepEqual(values.boundMoved([1, 2], 0, 3), [3, 3]);
  assert.deepEqual(values.boundMoved([1, 2], 1, 0), [0, 0]);
  assert.deepEqual(values.boundMoved([1, 2], 1, Infinity), [1, Infinity]);
});

test('several ranges are those of a view, if the data set has every range', () => {
  const every = { range: [-Infinity, Infinity], values: [0, 12], hasEveryRange: true, hasRangesWithin: true };
  const one = { ...every, range: [0, 4], hasEveryRange: false, hasRangesWithin: false };
  const { ranges } = fromHash('#range=1,2&range=3,4,0A0b0c,2&range=5,inf&range=6,7&range=8,9');
  assert.deepEqual(values.rangesOf(every, { range: null, ranges }), [[1, 2], [3, 4], [5, Infinity], [6, 7]], 'four at most');
  assert.deepEqual(values.rangesOf(one, { range: null, ranges }), []);
  assert.deepEqual(values.rangesOf(every, { range: [1, 3], ranges: [] }), [[1, 3]]);
  assert.deepEqual(ranges[1].style, { color: '#0a0b0c', opacity: 1 });
  assert.equal(new Set(ranges.map(({ style }) => style.color)).size, 4);
  assert.deepEqual(stylesOf({ ...kDefaults, ranges }).map(({ alpha }) => alpha), ranges.map(({ style }) => style));
  assert.deepEqual(fromHash('#range=1,2,000000,1').range, [1, 2], 'one has the styles of the surfaces');
});

test('one more range lies in the middle of the widest part that no range has', () => {
  assert.deepEqual(values.freeRange([0, 12], [[6, 12]]), [2, 4]);
  assert.deepEqual(values.freeRange([0, 12], [[9, Infinity], [-Infinity, 3]]), [5, 7]);
  assert.deepEqual(values.freeRange([0, 12], [[1, 8], [2, 3], [11, 12]]), [9, 10]);
  assert.deepEqual(values.freeRange([0, 12], [[-1, 6], [5, 20]]), [4, 8], 'there is none');
  assert.deepEqual(values.freeRange([3, 3], [[3, 3]]), [3, 3]);
});

test('the span of colours is the part of the range that the values reach, unless it is set', () => {
  const every = { range: [-Infinity, Infinity], values: [-1, 5], hasEveryRange: true, hasRangesWithin: true };
  const one = { range: [2, Infinity], values: [-1, 5], hasEveryRange: false, hasRangesWithin: false };
  assert.deepEqual(ranges.spanOf(every, [[2, 5]], null), [2, 5]);
  assert.deepEqual(ranges.spanOf(every, [[-3, 1]], null), [-1, 1]);
  assert.deepEqual(ranges.spanOf(every, [[-Infinity, Infinity]], null), [-1, 5]);
  assert.deepEqual(ranges.spanOf(every, [[8, 9]], null), [5, 5]);
  assert.deepEqual(ranges.spanOf(every, [[3, 4], [0, 1]], null), [0, 4], 'of all ranges');
  assert.deepEqual(ranges.spanOf(one, [], null), [2, 5], 'this one shows its own range only');
  assert.deepEqual(ranges.spanOf(every, [[1, 2]], [-7, 99]), [-7, 99]);
  for (const channel of [null, 'heat', 'T & v=1, é']) assert.equal(fromHash(toHash({ ...kDefaults, channel })).channel, channel);
  for (const span of [[0, 0], [1 / 3, 1e-9 + 1 / 3], [-1e30, 5e-324]]) assert.deepEqual(fromHash(toHash({ ...kDefaults, span })).span, span);
});

test('colours show one thing at a time', () => {
  assert.deepEqual(exclusive({ colorBy: 'value' }), { colorBy: 'value', thickness: false, levels: false });
  assert.deepEqual(exclusive({ render: 'volume' }), { render: 'volume', thickness: false, levels: false });
  for (const name of ['thickness', 'levels']) assert.deepEqual(exclusive({ [name]: true }), { [name]: true, colorBy: 'surface', render: 'surface' });
  for (const change of [{ colorBy: 'surface' }, { thickness: false }, { wireframe: true }]) assert.deepEqual(exclusive(change), change);
  const { colorBy, thickness, levels } = fromHash('#color=value&show=thickness,levels');
  assert.deepEqual([colorBy, thickness, levels], ['value', false, false]);
});

test('a palette has its bytes as colours, and the default stands in for one that is not known', () => {
  const bytes = Uint8Array.from({ length: 768 }, () => Math.floor(random(0, 256)));
  const grey = palette.paletteOf({ name: 'grey', colours: bytes.buffer });
  assert.deepEqual(grey.colors.flat().map((x) => Math.round(255 * x)), [...bytes]);
  const other = { name: 'ice', colors: [] };
  assert.equal(palette.chosenPalette([other, grey], 'grey'), grey);
  for (const name of [null, 'none']) assert.equal(palette.chosenPalette([other, grey], name), other);
  assert.equal(palette.chosenPalette([], 'grey'), null);
});

test('the share that a range encloses is the sum over what lies between', () => {
  const pieces = Array.from({ length: 12 }, () => [random(-3, 3), random(0, 1)]); // at a value, so much
  const total = pieces.reduce((sum, [, share]) => sum + share, 0);
  const below = (value, withEqual) => pieces.reduce((sum, [at, share]) => sum + (at < value || (withEqual && at === value) ? share : 0), 0) / total;
  const at = pieces.map(([value]) => value).sort((a, b) => a - b);
  const statistics = { volumes: { values: at, below: at.map((v) => below(v, false)), notAbove: at.map((v) => below(v, true)) } };
  for (const low of [-Infinity, -4, ...at, 0.1]) {
    for (const high of [...at, 0.2, 4, Infinity].filter((value) => value >= low)) {
      assertNear(values.enclosedShare(statistics, [low, high]), below(high, true) - below(low, false));
    }
  }
  const even = { volumes: { values: [0, 4], below: [0, 1], notAbove: [0, 1] } };
  assertNear(values.enclosedShare(even, [1, 2]), 0.25);
});

test('a value with few digits is off by half a step at most', () => {
  for (let i = 0; i < 100; ++i) {
    const [value, step] = [random(-1000, 1000), 10 ** random(-6, 2)];
    assert.ok(Math.abs(values.rounded(value, step) - value) <= step / 2 + 1e-9);
  }
  assert.equal(values.rounded(57.6, 1), 58);
  assert.equal(values.rounded(0.5039, 0.0078), 0.504);
  assert.equal(values.rounded(0.3, 1), 0);
  assert.equal(values.rounded(0, 1), 0);
});

test('a rotation keeps the distance, and its inverse restores the camera', () => {
  for (let i = 0; i < 100; ++i) {
    const pose = randomPose();
    const [right, down] = [random(-3, 3), random(-3, 3)];
    const rotated = camera.orbited(pose, right, down);
    assert.ok(isNear([vec.length(vec.sub(rotated.eye, rotated.lookAt))], [vec.length(vec.sub(pose.eye, pose.lookAt))]));
    const back = camera.orbited(camera.orbited(pose, right, 0), -right, 0);
    assert.ok(isNear(back.eye, pose.eye, 1e-6));
  }
});

test('zooming keeps the point under the pointer', () => {
  for (let i = 0; i < 100; ++i) {
    const pose = randomPose();
    const at = [random(-300, 300), random(-200, 200)];
    const there = camera.zoomed(pose, random(0.2, 3), at, 600);
    const a = camera.axes(pose);
    const perPixel = camera.unitsPerPixel(pose, 600);
    const fixed = vec.along(vec.along(pose.lookAt, a.right, at[0] * perPixel), a.up, -at[1] * perPixel);
    const spot = camera.projected(there, fixed, 800, 600);
    assert.ok(isNear([spot.x, spot.y], [400 + at[0], 300 + at[1]], 1e-6));
  }
});

test('the ray through a pixel passes the point that is projected to it', () => {
  for (let i = 0; i < 100; ++i) {
    const pose = randomPose();
    const [x, y] = [random(0, 800), random(0, 600)];
    const p = vec.along(pose.eye, camera.rayThrough(pose, x, y, 800, 600), random(1, 50));
    const spot = camera.projected(pose, p, 800, 600);
    assert.ok(isNear([spot.x, spot.y], [x, y], 1e-6));
  }
});

test('the fitted view shows every corner of the box at any aspect ratio', () => {
  const box = { min: [-10, 0, 5], max: [40, 20, 90] };
  for (const [width, height] of [[1600, 900], [360, 640], [500, 500]]) {
    const pose = camera.fitted(box, width / height);
    for (const corner of vec.corners(box)) {
      const { x, y, depth } = camera.projected(pose, corner, width, height);
      assert.ok(depth > 0 && x > -0.02 * width && x < 1.02 * width && y > -0.02 * height && y < 1.02 * height, `${width} x ${height}: ${x}, ${y}`);
    }
  }
});

test('the outline of a plane in a box is a closed polygon of 3 to 6 sides in the plane', () => {
  const box = { min: [-1, -2, -3], max: [4, 3, 2] };
  for (let i = 0; i < 200; ++i) {
    const normal = vec.unit(randomVec());
    const [least, most] = plane.offsetRange(box, normal);
    const cut = { normal, offset: random(least, most) };
    const points = plane.planeOutline(box, cut);
    const sides = points.length / 2;
    assert.ok(sides >= 3 && sides <= 6, `${sides} sides`);
    for (const p of points) {
      assert.ok(Math.abs(vec.dot(normal, p) - cut.offset) < 1e-9);
      assert.equal(points.filter((q) => isNear(p, q, 1e-9)).length, 2, 'every corner belongs to two sides');
    }
  }
});

test('a rotated plane touches the box and has a unit normal', () => {
  const box = { min: [-1, -2, -3], max: [4, 3, 2] };
  for (let i = 0; i < 200; ++i) {
    const before = plane.clamped(box, { normal: vec.unit(randomVec()), offset: random(-9, 9) });
    const rotated = plane.rotatedTowards(box, before, randomVec());
    const [least, most] = plane.offsetRange(box, rotated.normal);
    assert.ok(rotated.offset >= least - 1e-9 && rotated.offset <= most + 1e-9);
    assert.ok(Math.abs(vec.length(rotated.normal) - 1) < 1e-9);
  }
});

test('both normals of a plane give it one position, on an axis the coordinate there', () => {
  for (let i = 0; i < 100; ++i) {
    const normal = vec.unit(randomVec());
    const offset = random(-9, 9);
    assert.equal(plane.facing(normal) * offset, plane.facing(vec.scale(normal, -1)) * -offset);
  }
  for (const axis of vec.kAxes) assert.deepEqual([plane.facing(axis), plane.facing(vec.scale(axis, -1))], [1, -1]);
});

test('a region stays within the data, and min below max', () => {
  const within = { min: [0, 0, 0], max: [10, 20, 30] };
  let now = region.middleHalf(within);
  for (let i = 0; i < 500; ++i) {
    now = i % 3 ? region.faceMoved(now, within, i % 2, i % 5 ? 'min' : 'max', random(-40, 40)) : region.wholeMoved(now, within, randomVec(40));
    for (const axis of [0, 1, 2]) assert.ok(now.min[axis] >= -1e-9 && now.max[axis] <= within.max[axis] + 1e-9 && now.min[axis] < now.max[axis]);
  }
});

test('a frame has the box around the corners of any grid', () => {
  for (let i = 0; i < 200; ++i) {
    const affine = Array.from({ length: 12 }, () => random(-3, 3));
    const dims = [0, 1, 2].map(() => Math.floor(random(2, 50)));
    const { box, leastSpacing } = frame.frameOf({ dims, affine });
    for (const axis of [0, 1, 2]) {
      const row = affine.slice(4 * axis, 4 * axis + 4);
      const reach = (sign) => row[3] + [0, 1, 2].reduce((sum, k) => sum + (row[k] * sign > 0 ? row[k] * (dims[k] - 1) : 0), 0);
      assertNear(box.min[axis], reach(-1));
      assertNear(box.max[axis], reach(1));
      assert.ok(leastSpacing <= vec.length([affine[axis], affine[4 + axis], affine[8 + axis]]) + 1e-9);
    }
  }
  const plain = frame.frameOf({ dims: [3, 4, 5], affine: [0.5, 0, 0, -1, 0, 2, 0, 3, 0, 0, 1, 0] });
  assert.deepEqual(plain.box, { min: [-1, 3, 0], max: [0, 9, 4] });
  assert.equal(plain.leastSpacing, 0.5);
});

test('numbers have the digits that are significant', () => {
  assert.equal(format.bounded(43844.2, 10), '43,844 ± 10');
  assert.equal(format.bounded(123456, 2000), '123,000 ± 2,000');
  assert.equal(format.bounded(1234.4, 0), '1,234');
  assert.equal(format.bounded(1234.4, null), '1,234');
  assert.equal(format.bytes(999), '999 B');
  assert.equal(format.bytes(1.5e6), '1.5 MB');
  assert.equal(format.short(-Infinity), '−∞');
  assert.equal(format.count(1234567), '1.23 million');
  for (let i = 0; i < 100; ++i) {
    const x = 10 ** random(-8, 8);
    assert.ok(format.roundUp(x) >= x * (1 - 1e-9) && format.roundUp(x) <= 1.6 * x);
  }
});

test('a preview gets coarser until a step is done in time, and not finer again if that would be too slow', () => {
  for (let i = 0; i < 50; ++i) {
    const pace = new PreviewPace();
    const counts = [10 ** random(3, 7)]; // of meshes whose levels have between a hundredth and half of their updates
    while (counts.at(-1) > 1) counts.push(Math.floor(counts.at(-1) * random(0.5, 0.99)));
    const msPerUpdate = 10 ** random(-4, -2.5);
    const msOf = (levels) => counts[levels] * msPerUpdate;
    const most = Math.max(0, counts.findLastIndex((count) => count >= 1000));
    let made = null; // levels of the coarse mesh that is there
    const step = () => {
      const ms = made === pace.levels ? msOf(pace.levels) : 1.5 * msOf(pace.levels);
      made = pace.levels;
      pace.took(ms);
      return { levels: made, ms };
    };
    pace.begin(counts);
    const steps = Array.from({ length: 60 }, step);
    const last = steps.at(-1).levels;
    assert.ok(msOf(last) <= 40 || last === most, `${msOf(last)} ms`);
    assert.ok(last === 0 || msOf(last - 1) > 20, 'no coarser than needed');
    assert.deepEqual(new Set(steps.slice(45).map(({ levels }) => levels)), new Set([last]), 'at rest');
    made = null;
    pace.begin(counts);
    const { levels, ms } = step();
    assert.ok(ms <= 31 || levels === most, `the first step of the next drag: ${ms} ms`);
  }
});

test('opacities are linear between their points, and points keep their order', () => {
  const curve = opacity.readOpacity('-1:0.5,0:0,3:0.6');
  assert.deepEqual([-9, -1, -0.5, 0, 1, 3, 9].map((x) => opacity.opacityAt(curve, x)), [0.5, 0.5, 0.25, 0, 0.6 / 3, 0.6, 0.6]);
  for (const text of ['', '1', '1:', ':1', '1:2', '1:-1', '1:0,1:1', '2:0,1:1', '1:0:3', 'a:0', '1:0,', Array.from({ length: 257 }, (_, i) => `${i}:0`).join()]) {
    assert.equal(opacity.readOpacity(text), null, text);
  }
  for (let i = 0; i < 100; ++i) {
    let changed = opacity.pointMoved(curve, i % 3, { value: random(-5, 5), opacity: random(-1, 2) }, 0.01);
    changed = opacity.pointAdded(changed, { value: random(-5, 5), opacity: random() });
    assert.equal(changed.length, 4);
    assert.ok(opacity.readOpacity(opacity.writeOpacity(changed)), JSON.stringify(changed));
    for (let k = 0; k < 9; ++k) changed = opacity.pointRemoved(changed, 0);
    assert.equal(changed.length, 1);
  }
});

test('a transfer table has rates and their integrals; what is hidden has none', () => {
  const look = { values: [2, 4], opacity: [{ value: 2, opacity: 0 }, { value: 4, opacity: 0.5 }], colors: [[0, 0, 0], [1, 0.5, 0]], span: [2, 4] };
  const [cells, table, half] = [opacity.kCells, opacity.transferTable(look, []), opacity.transferTable(look, [[2, 3]])];
  const rate = (of, i) => [...of.subarray(4 * i, 4 * i + 4)];
  const sum = (of, i) => rate(of, cells + 1 + i);
  assertNear(rate(table, cells), [Math.log(2), Math.log(2) * 0.5 ** 2.2, 0, Math.log(2)]);
  assertNear(rate(table, cells / 2), [0.5 ** 2.2, 0.25 ** 2.2, 0, 1].map((x) => -Math.log(0.75) * x));
  // The integral of -log(1 - x / 2) from 0 to 1
  assertNear(sum(table, cells)[3], 1 - Math.log(2));
  assert.deepEqual([sum(half, cells / 2), rate(half, cells / 2), rate(half, cells)], [[0, 0, 0, 0], [0, 0, 0, 0], rate(table, cells)]);
});

test('the address of a data set has a server and a name', () => {
  const parts = (text) => {
    const { base, name } = addressOf(text);
    return [base.href, name];
  };
  assert.deepEqual(parts('ws://h:8080/scan'), ['http://h:8080/', 'scan']);
  assert.deepEqual(parts('wss://h/below/a%20b'), ['https://h/below/', 'a b']);
  assert.deepEqual(parts('https://h/scan?x=1#y'), ['https://h/', 'scan']);
  for (const wrong of ['h', 'ftp://h/scan', 'ws://h', 'ws://h/below/', 'ws://h/%zz', 'ws://h/%ff', '']) assert.throws(() => addressOf(wrong), TypeError, wrong);
});

test('arrays of a piece are in the world, relative to the origin', () => {
  const vertices = new ArrayBuffer(32);
  new Float32Array(vertices).set([1, 2, 3, 0, -4, 5, 6]);
  new Int8Array(vertices).set([127, 0, -127, 200], 12);
  new Int8Array(vertices).set([-1, 2, 3, 7], 28);
  const affine = [0, 2, 0, 10, 3, 0, 0, 20, 0, 0, -1, 30];
  const indices = Uint32Array.of(0, 1, 0).buffer;
  const arrays = arraysOf({ vertices, indices, values: null, triangles: [0, 1, 0] }, affine, [1, 1, 1]);
  assert.deepEqual([...arrays.positions], [13, 22, 26, 19, 7, 23]);
  assert.deepEqual([...arrays.normals], [127, 0, -127, 0, -1, 2, 3, 0]);
  assert.deepEqual([...arrays.levels], [200, 7]);
  assert.deepEqual([[...arrays.indices], arrays.values, arrays.groups], [[0, 1, 0], null, [0, 1, 0]]);
});
