// How coarse a stand-in must be, from how long pictures take: no browser, no clock.
import assert from 'node:assert/strict';
import { test } from 'node:test';

import { load } from './modules.mjs';

const { FramePace } = await load('/package/src/frame_pace.ts');

const seed = Number(process.env.INTERVALE_SEED ?? Date.now() % 1e6);
console.log(`seed ${seed} (INTERVALE_SEED)`);
let last = seed;
const random = (low, high) => {
  last = (last * 1103515245 + 12345) % 2147483648;
  return low + ((high - low) * last) / 2147483648;
};

// A machine that takes `fixed` ms for a picture, and `each` for a triangle; stand-ins have up to 1.6 times fewer
// triangles than they may.
test('a stand-in is drawn in time, or gets no coarser than is of use; a mesh that is drawn in time has none', () => {
  for (let i = 0; i < 500; ++i) {
    const pace = new FramePace();
    const [allowed, fixed, each] = [random(5, 50), random(0, 60), 10 ** random(-5, -3)];
    const all = Math.round(10 ** random(3, 7));
    const msOf = (triangles) => fixed + each * triangles;
    for (let k = 0; k < 3; ++k) pace.drewAll(all, msOf(all), allowed);
    assert.equal(pace.budget !== null, msOf(all) > allowed);
    if (pace.budget === null) continue;
    const part = new Map(); // of each budget
    const draw = () => {
      if (!part.has(pace.budget)) part.set(pace.budget, random(1, 1.6));
      const triangles = pace.budget / part.get(pace.budget);
      if (triangles >= all) pace.drewAll(all, msOf(all), allowed); // there is no stand-in
      else pace.drewStandIn(triangles, msOf(triangles), allowed);
      return pace.budget;
    };
    const last = Array.from({ length: 20 }, draw).at(-1);
    const [ofTriangles, room] = [each * last, Math.max(allowed - fixed, allowed / 2, fixed / 4)];
    const isSmall = each * all < 0.11 * msOf(all); // triangles matter little
    assert.ok(ofTriangles < 1.3 * room || last === 1000, `${ofTriangles} ms of ${room}`);
    assert.ok(ofTriangles > room / 1.6 || last >= all || isSmall, `${ofTriangles} ms of ${room}: coarser than needed`);
    for (let k = 0; k < 20; ++k) assert.equal(draw(), last, 'it rests');
    for (let k = 0; k < 3; ++k) pace.drewAll(all, msOf(all), allowed);
    assert.equal(pace.budget, last, 'what was learned stays');
  }
});

test('a single slow picture changes nothing for long', () => {
  const pace = new FramePace();
  pace.drewAll(1e5, 500, 15);
  pace.drewAll(1e5, 5, 15);
  assert.equal(pace.budget, null, 'of the whole mesh');
  pace.drewAll(1e6, 100, 15);
  const { budget } = pace;
  for (let k = 0; k < 9; ++k) pace.drewStandIn(budget - 9, k % 2 ? 500 : 12, 15);
  assert.ok(pace.budget >= budget, 'of a stand-in');
});
