// A fake of the page's worker, for tests without a server: speaks package/src/messages.ts. Its mesh is the part of a gyroid
// field between two values, clipped from the tetrahedra of successively finer grids. It has one mesh for each range if
// the page asks for several; else the range is always the same. The data set's name selects a fault: "lost" loses its
// connection, "broken" fails to open, "full" reaches its memory limit.

const kSide = 48; // of the cube, in sample spacings
const kRange = [-0.45, 0.75]; // of the one mesh
const kGrids = [4, 8, 16]; // cells per side
const kPieceSide = 16; // of a piece of the boundary surface, in sample spacings

const field = (x, y, z) => {
  const [a, b, c] = [x, y, z].map((v) => (v / kSide) * 2 * Math.PI * 1.25);
  return Math.sin(a) * Math.cos(b) + Math.sin(b) * Math.cos(c) + Math.sin(c) * Math.cos(a);
};
const gradientDirection = ([x, y, z]) => {
  const h = 0.01;
  const g = [field(x + h, y, z) - field(x - h, y, z), field(x, y + h, z) - field(x, y - h, z), field(x, y, z + h) - field(x, y, z - h)];
  const l = Math.hypot(...g) || 1;
  return g.map((v) => v / l);
};

class Mesh {
  // n: cells per side; index: of the range.
  constructor(n, range, index) {
    this.index = index;
    this.vertices = []; // {p, f, surface}
    this.tets = [];
    const cuts = new Map();
    const step = kSide / n;
    const at = (i, j, k) => (i * (n + 1) + j) * (n + 1) + k;
    for (let i = 0; i <= n; ++i) for (let j = 0; j <= n; ++j) for (let k = 0; k <= n; ++k) {
      const p = [i * step, j * step, k * step];
      this.vertices.push({ p, f: field(...p), surface: 0 });
    }
    const cut = (a, b, value, surface) => {
      const key = `${Math.min(a, b)} ${Math.max(a, b)} ${surface}`;
      if (!cuts.has(key)) {
        const [u, v] = a < b ? [this.vertices[a], this.vertices[b]] : [this.vertices[b], this.vertices[a]];
        const t = (value - u.f) / (v.f - u.f);
        cuts.set(key, this.vertices.push({ p: u.p.map((x, d) => x + t * (v.p[d] - x)), f: value, surface }) - 1);
      }
      return cuts.get(key);
    };
    // The tetrahedra of the part where sign * (f - value) >= 0. Neighbours split a common face alike, since vertices
    // are taken in the order of their indices.
    const clip = (tet, value, sign, surface) => {
      const sorted = [...tet].sort((a, b) => a - b);
      const inside = sorted.filter((v) => sign * (this.vertices[v].f - value) >= 0);
      const outside = sorted.filter((v) => !inside.includes(v));
      const c = (a, b) => cut(a, b, value, surface);
      const prism = ([a0, a1, a2], [b0, b1, b2]) => [[a0, a1, a2, b0], [a1, a2, b0, b1], [a2, b0, b1, b2]];
      const [o, q] = outside;
      if (inside.length === 4) return [tet];
      if (inside.length === 0) return [];
      if (inside.length === 1) return [[inside[0], ...outside.map((v) => c(inside[0], v))]];
      if (inside.length === 3) return prism(inside, inside.map((v) => c(v, o)));
      return prism([inside[0], c(inside[0], o), c(inside[0], q)], [inside[1], c(inside[1], o), c(inside[1], q)]);
    };
    const orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    for (let i = 0; i < n; ++i) for (let j = 0; j < n; ++j) for (let k = 0; k < n; ++k) {
      for (const order of orders) {
        const corner = [i, j, k];
        const tet = [at(...corner)];
        for (const axis of order) {
          corner[axis]++;
          tet.push(at(...corner));
        }
        for (const part of clip(tet, range[0], 1, 1)) this.tets.push(...clip(part, range[1], -1, 2));
      }
    }
    const oriented = ([a, b, c, d]) => (this.volume([a, b, c, d]) > 0 ? [a, b, c, d] : [b, a, c, d]);
    this.tets = this.tets.filter((tet) => Math.abs(this.volume(tet)) > 1e-9).map(oriented);
    this.level = Math.round(Math.log2(step));
  }
  volume(tet) {
    const [a, b, c, d] = tet.map((v) => this.vertices[v].p);
    const [u, v, w] = [b, c, d].map((p) => p.map((x, i) => x - a[i]));
    return (u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) + u[2] * (v[0] * w[1] - v[1] * w[0])) / 6;
  }
  center(tet) {
    return [0, 1, 2].map((d) => tet.reduce((sum, v) => sum + this.vertices[v].p[d] / 4, 0));
  }
  static faces([a, b, c, d]) {
    return [[b, c, d], [a, d, c], [a, b, d], [a, c, b]];
  }
  // The pieces of the boundary: the faces that only one tetrahedron has.
  boundary() {
    const unpaired = new Map();
    for (const tet of this.tets) for (const face of Mesh.faces(tet)) {
      const key = [...face].sort((a, b) => a - b).join(' ');
      if (unpaired.has(key)) unpaired.delete(key);
      else unpaired.set(key, { face, at: this.center(tet) });
    }
    const pieces = new Map();
    for (const { face, at } of unpaired.values()) {
      const id = at.reduce((sum, x) => sum * 8 + Math.floor(Math.min(x, kSide - 1) / kPieceSide), 0);
      if (!pieces.has(id)) pieces.set(id, [[], [], []]);
      const surfaces = face.map((v) => this.vertices[v].surface);
      const group = surfaces.every((s) => s === 1) ? 0 : surfaces.every((s) => s === 2) ? 1 : 2;
      pieces.get(id)[group].push(face);
    }
    return [...pieces].map(([id, groups]) => this.piece(id, groups));
  }
  // groups: the faces on alpha, on beta and on the cube.
  piece(id, groups) {
    const indexOf = new Map();
    const list = []; // vertices: p, the value f, and the normal n
    const indices = [];
    const edges = [];
    const edgeCounts = [0, 0, 0];
    groups.forEach((faces, group) => {
      const known = new Set(); // edges
      for (const face of faces) {
        const ps = face.map((v) => this.vertices[v].p);
        const axis = [0, 1, 2].find((d) => ps.every((p) => p[d] === ps[0][d] && (p[d] === 0 || p[d] === kSide)));
        const side = axis === undefined ? 'i' : `${axis}${ps[0][axis]}`;
        const own = face.map((v) => {
          const key = `${v} ${group} ${group === 2 ? side : ''}`;
          if (!indexOf.has(key)) {
            indexOf.set(key, list.length);
            const { p, f } = this.vertices[v];
            const ofCube = () => [0, 1, 2].map((d) => (d === axis ? (p[d] === 0 ? -1 : 1) : 0));
            const ofSurface = () => gradientDirection(p).map((x) => (group === 0 ? -x : x));
            list.push({ p, f, n: group === 2 ? ofCube() : ofSurface() });
          }
          return indexOf.get(key);
        });
        indices.push(...own);
        for (const [a, b] of [[0, 1], [1, 2], [2, 0]]) {
          const key = [own[a], own[b]].sort((x, y) => x - y).join(' ');
          if (known.has(key)) continue;
          known.add(key);
          edges.push(own[a], own[b]);
          edgeCounts[group]++;
        }
      }
    });
    const vertices = new ArrayBuffer(16 * list.length);
    const view = new DataView(vertices);
    list.forEach(({ p, n }, i) => {
      p.forEach((x, d) => view.setFloat32(16 * i + 4 * d, x, true));
      n.forEach((x, d) => view.setInt8(16 * i + 12 + d, Math.round(127 * x)));
      view.setUint8(16 * i + 15, this.level + (p[0] > kSide / 2 ? 1 : 0));
    });
    const bound = (pick) => [0, 1, 2].map((d) => pick(...list.map(({ p }) => p[d])));
    return {
      id: 4 * id + this.index, range: this.index, vertices, values: valuesOf(list), indices: new Uint32Array(indices).buffer, edges: wantsEdges ? new Uint32Array(edges).buffer : null,
      triangles: groups.map((faces) => faces.length), edgeCounts, min: bound(Math.min), max: bound(Math.max),
    };
  }
  // The section by a plane, in samples.
  cap(plane) {
    const corners = []; // of triangles: p, the value f, and the distances from the sides
    for (const tet of this.tets) {
      const d = tet.map((v) => this.vertices[v].p.reduce((sum, x, i) => sum + x * plane.normal[i], -plane.offset));
      const pos = [0, 1, 2, 3].filter((i) => d[i] > 0);
      if (pos.length === 0 || pos.length === 4) continue;
      const neg = [0, 1, 2, 3].filter((i) => d[i] <= 0);
      const point = (i, j) => {
        const [a, b] = [this.vertices[tet[i]], this.vertices[tet[j]]];
        const between = (x, y) => x + (d[i] / (d[i] - d[j])) * (y - x);
        return { p: a.p.map((x, k) => between(x, b.p[k])), f: between(a.f, b.f) };
      };
      const edges =
        pos.length === 2 ? [[pos[0], neg[0]], [pos[0], neg[1]], [pos[1], neg[1]], [pos[1], neg[0]]]
        : pos.length === 1 ? neg.map((n) => [pos[0], n])
        : pos.map((p) => [p, neg[0]]);
      const points = edges.map(([i, j]) => point(i, j));
      const all = [[255, 0, 0], [0, 255, 0], [0, 0, 255]];
      if (points.length === 3) corners.push(...points.map((at, i) => ({ ...at, sides: all[i] })));
      // The side opposite to the second corner is the quadrilateral's diagonal: not drawn as an edge.
      else for (const triangle of [[0, 1, 2], [2, 3, 0]]) {
        corners.push(...triangle.map((i, k) => ({ ...points[i], sides: [[255, 255, 0], [0, 255, 0], [0, 255, 255]][k] })));
      }
    }
    const vertices = new ArrayBuffer(16 * corners.length);
    const view = new DataView(vertices);
    corners.forEach(({ p, sides }, i) => {
      p.forEach((x, d) => view.setFloat32(16 * i + 4 * d, x, true));
      sides.forEach((s, d) => view.setUint8(16 * i + 12 + d, s));
      view.setUint8(16 * i + 15, this.level);
    });
    return { vertices, values: valuesOf(corners), triangles: corners.length / 3 };
  }
  // The tetrahedra whose centres are in a box, in samples.
  inBox(box) {
    const tets = this.tets.filter((tet) => this.center(tet).every((x, d) => x >= box.min[d] && x <= box.max[d]));
    const vertices = new ArrayBuffer(28 * 4 * tets.length);
    const view = new DataView(vertices);
    tets.forEach((tet, t) => {
      tet.forEach((v, i) => {
        const at = 28 * (4 * t + i);
        this.vertices[v].p.forEach((x, d) => view.setFloat32(at + 4 * d, x, true));
        this.center(tet).forEach((x, d) => view.setFloat32(at + 12 + 4 * d, x, true));
        view.setUint8(at + 24, this.vertices[v].surface);
        view.setUint8(at + 25, this.level);
        view.setUint8(at + 26, this.index);
      });
    });
    return { vertices, values: valuesOf(tets.flat().map((v) => this.vertices[v])), count: tets.length, outOf: tets.length };
  }
}

// All tetrahedra of the meshes, and their order from an eye, in samples.
function volumeOf(all) {
  const points = all.flatMap(({ vertices }) => vertices.flatMap(({ p, f }) => [...p, f]));
  const firsts = all.map((_, i) => all.slice(0, i).reduce((sum, { vertices }) => sum + vertices.length, 0));
  const tets = all.flatMap((mesh, i) => mesh.tets.flatMap((tet) => tet.map((v, k) => v + firsts[i] + (k === 0 ? mesh.index * 2 ** 30 : 0))));
  return { points: Float32Array.from(points).buffer, tets: Uint32Array.from(tets).buffer };
}
function orderOf(all, eye) {
  const distances = all.flatMap((mesh) => mesh.tets.map((tet) => Math.hypot(...mesh.center(tet).map((x, d) => x - eye[d]))));
  return Uint32Array.from(distances.keys()).sort((a, b) => distances[b] - distances[a]).buffer;
}

let ranges = [kRange];
let meshes = []; // of each range
let step = -1; // the index of the mesh's grid
let version = 0;
let plane = null;
let box = null;
let wantsEdges = false;
let wantsValues = false;
let wantsVolume = false;
let eye = [0, 0, 0];
let name = '';
let timer = 0;

const post = (report) => self.postMessage(report);
const valuesOf = (list) => (wantsValues ? Float32Array.from(list, ({ f }) => f).buffer : null);
const sum = (of) => meshes.reduce((total, mesh) => total + of(mesh), 0);
const joined = (buffers) => {
  const bytes = buffers.flatMap((buffer) => [...new Uint8Array(buffer ?? [])]);
  return Uint8Array.from(bytes).buffer;
};
const joinedValues = (parts) => (wantsValues ? joined(parts.map(({ values }) => values)) : null);
const toSamples = (p) => p.map((x) => x + kSide / 2); // the origin of the world is the centre of the cube

function postProgress(done) {
  const updates = [0, 900, 6200, 48000][step + 1];
  post({ type: 'progress', progress: {
    view: viewNumber,
    bytes: updates * 2.1 + 900, updates, updatesInMesh: updates, updatesShown: updates, tets: sum((mesh) => mesh.tets.length), triangles: 0, updatesToGo: done ? 0 : 48000 - updates,
    remainingError: done ? 0.0123 : 0.4 / (step + 2), remainingPixels: done ? 0.92 : 60 / (step + 2), done, full: name === 'full',
    volumes: meshes.map((mesh) => mesh.tets.reduce((volume, tet) => volume + mesh.volume(tet), 0)), volumeBound: 900 / 4 ** (step + 1), memory: 12.4e6,
    busy: { updates, seconds: updates / 2.1e6 }, reconnects: 0, repeated: 0,
  } });
}
function postCap() {
  const inSamples = plane && { normal: plane.normal, offset: plane.offset + plane.normal.reduce((sum, n) => sum + (n * kSide) / 2, 0) };
  const parts = inSamples ? meshes.map((mesh) => mesh.cap(inSamples)) : [];
  const triangles = parts.map((part) => part.triangles);
  post({ type: 'cap', cap: { plane, version, vertices: joined(parts.map(({ vertices }) => vertices)), values: joinedValues(parts), triangles } });
}
function postTets() {
  const parts = box ? meshes.map((mesh) => mesh.inBox({ min: toSamples(box.min), max: toSamples(box.max) })) : [];
  const count = parts.reduce((total, part) => total + part.count, 0);
  post({ type: 'tets', tets: { box, vertices: joined(parts.map(({ vertices }) => vertices)), values: joinedValues(parts), count, outOf: count } });
}
function postVolume() {
  post({ type: 'volume', volume: { ...volumeOf(meshes), order: orderOf(meshes, eye), version } });
}
function postSurface(reset) {
  version++;
  if (wantsVolume) postVolume();
  const pieces = meshes.flatMap((mesh) => mesh.boundary());
  post({ type: 'surface', change: { version, hasValues: wantsValues, ranges: meshes.length, reset: reset ? [0, 1, 2, 3] : [], pieces, removed: [] } });
  if (plane) postCap();
  if (box) postTets();
}
// The mesh of the coarsest grid, whatever the page has time for.
function postStandIn(most) {
  if (most === null) return post({ type: 'standIn', change: null });
  const pieces = ranges.flatMap((range, index) => new Mesh(kGrids[0], range, index).boundary());
  post({ type: 'standIn', change: { version: ++standIns, hasValues: wantsValues, ranges: ranges.length, reset: [0, 1, 2, 3], pieces, removed: [] } });
}
function makeMeshes() {
  meshes = ranges.map((range, index) => new Mesh(kGrids[step], range, index));
}
function refine() {
  if (step + 1 >= kGrids.length - (wantsVolume ? 1 : 0)) return postProgress(true); // all tetrahedra take long to draw without a graphics card
  ++step;
  makeMeshes();
  postSurface(step === 0);
  postProgress(false);
}
function look(view) {
  eye = toSamples(view.camera.eye);
  if (wantsVolume && meshes.length > 0) post({ type: 'order', version, order: orderOf(meshes, eye) });
  const wanted = view.ranges.length > 1 ? view.ranges : [kRange];
  if (JSON.stringify(wanted) === JSON.stringify(ranges)) return;
  ranges = wanted;
  if (meshes.length === 0) return;
  makeMeshes();
  postSurface(true);
}

function open(dataset) {
  clearTimeout(timer);
  [meshes, step, name] = [[], -1, dataset];
  if (name === 'broken') return post({ type: 'error', text: 'broken: the server has no such data set; see the list.' });
  post({ type: 'connection', state: { state: 'open' } });
  post({ type: 'opened', resumed: false });
  refine();
  if (name !== 'lost') return;
  post({ type: 'connection', state: { state: 'waiting', seconds: 8, attempt: 2, reason: 'the connection was interrupted' } });
  timer = setTimeout(() => {
    post({ type: 'connection', state: { state: 'connecting' } });
    post({ type: 'connection', state: { state: 'open' } });
    post({ type: 'opened', resumed: true });
    name = 'gyroid';
    refine();
  }, 3000);
}

// Two palettes: from blue to red, and from black to green.
const palette = (name, color) => ({ name, colours: Uint8Array.from({ length: 768 }, (_, i) => color(Math.floor(i / 3))[i % 3]).buffer });
post({ type: 'palettes', palettes: [palette('warm', (x) => [x, 0, 255 - x]), palette('green', (x) => [0, x, 0])] });

let viewNumber = 0;
let standIns = 0;
let probes = 0;
self.onmessage = ({ data }) => {
  if (data.type === 'open') {
    open(data.dataset);
  } else if (data.type === 'view') {
    viewNumber = data.number;
    look(data.view);
  } else if (data.type === 'shown' && data.version === version && name !== 'lost') {
    timer = setTimeout(refine, 30);
  } else if (data.type === 'preview') {
    postMessage({ type: 'preview' });
  } else if (data.type === 'clip') {
    plane = data.plane;
    postCap();
  } else if (data.type === 'tets') {
    box = data.box;
    postTets();
  } else if (data.type === 'standIn') {
    postStandIn(data.triangles);
  } else if (data.type === 'edges') {
    wantsEdges = data.wanted;
    if (meshes.length > 0) postSurface(false);
  } else if (data.type === 'values') {
    const isOther = data.wanted !== wantsValues;
    wantsValues = data.wanted;
    if (isOther && meshes.length > 0) postSurface(false);
  } else if (data.type === 'volume') {
    const isOther = data.wanted !== wantsVolume;
    wantsVolume = data.wanted;
    if (isOther && meshes.length > 0) postSurface(false);
  } else if (data.type === 'probe') { // the channel's values are late
    post({ type: 'probed', at: data.at, values: [field(...toSamples(data.at)), ++probes < 3 ? NaN : 2.5] });
  } else if (data.type === 'digest') {
    post({ type: 'digest', digest: '', updates: 0, tets: sum((mesh) => mesh.tets.length) });
  } else if (data.type === 'save') {
    post({ type: 'saved', format: data.format, name: `${name}.${data.format}`, bytes: new ArrayBuffer(16) });
  }
};
