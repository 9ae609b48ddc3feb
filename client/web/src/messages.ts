// What the page and the worker say to each other. The worker holds the connection, the client core and the mesh; the page draws and asks.
//
// Positions are in samples (0 at the first, dims - 1 at the last) unless said otherwise, so that 32 bits hold them exactly; world = origin + spacing *
// position. Cameras, planes and boxes are in world coordinates.

export type Vec3 = [number, number, number];

export interface Box {
  min: Vec3;
  max: Vec3;
}

export interface Camera {
  eye: Vec3;
  lookAt: Vec3;
  up: Vec3;
  fov: number; // vertical, degrees
  viewport: [number, number]; // pixels of the drawing buffer
}

// What lies on the normal's side, dot(normal, p) > offset, is cut away. normal: of length 1.
export interface Plane {
  normal: Vec3;
  offset: number;
}

export interface Dataset {
  name: string;
  dims: Vec3;
  spacing: Vec3;
  origin: Vec3;
  range: [number, number]; // may be infinite
  maxError: number; // field units
  updates: number; // in all
  fullTets: number;
  fullVertices: number;
}

// From the page to the worker.
export type Request =
  // Connects and streams; what was open before is closed. url: of the WebSocket, "ws://host:port/v1/stream".
  | { type: 'open'; url: string; dataset: string; token?: string }
  // What is wanted from now on. A region is refined to the end; without one, everything until it is off by no more than pixelError on the camera's
  // screen. Where nothing has been opened yet it is what is asked for first.
  | { type: 'view'; view: View }
  | { type: 'clip'; plane: Plane | null } // each answered by a Cap, the last one asked for first; those between may be left out
  | { type: 'tets'; box: Box | null } // tetrahedra wanted in this box, from now on after each change of the mesh
  | { type: 'edges'; wanted: boolean } // whether pieces come with their edges
  | { type: 'shown'; version: number } // the page shows this skin; the next one is made only then
  | { type: 'save'; format: 'vtu' | 'stl' | 'glb' }
  | { type: 'digest' } // asks for a Digest
  | { type: 'close' };

export interface View {
  camera: Camera;
  pixelError: number; // above 0
  region: Box | null;
  maxTets: number | null; // of the mesh
  maxUpdates: number | null; // kept in memory; some 30 bytes each on the server's side of the fence, see Progress.memory for here
}

// From the worker to the page.
export type Report =
  | { type: 'ready' } // the core is loaded; requests before that are kept
  | { type: 'connection'; state: ConnectionState }
  | { type: 'opened'; dataset: Dataset; resumed: boolean } // resumed: the mesh stays, and the stream goes on
  | { type: 'progress'; progress: Progress }
  | { type: 'skin'; skin: Skin }
  | { type: 'cap'; cap: Cap }
  | { type: 'tets'; tets: Tets }
  | { type: 'saved'; format: string; name: string; bytes: ArrayBuffer }
  | { type: 'digest'; digest: string; updates: number; tets: number }
  | { type: 'error'; text: string }; // what failed, for people; what was open is closed

export type ConnectionState =
  | { state: 'connecting' }
  | { state: 'open' }
  | { state: 'waiting'; seconds: number; attempt: number; reason: string } // lost; connects again in so many seconds
  | { state: 'closed' };

export interface Progress {
  bytes: number; // received in all, of messages
  updates: number; // that came so far
  updatesShown: number; // of those in the mesh; fewer where the budget of tetrahedra hides some
  tets: number;
  triangles: number; // of the skin
  updatesToGo: number; // bounds from above for this view: 0 when done
  remainingError: number; // field units
  remainingPixels: number;
  skin: number; // version of the last one that was sent to the page
  done: boolean; // all that this view wants has come, and that skin has it
  full: boolean; // ... that there is room for in memory
  volume: number; // of the mesh, in world units cubed
  volumeBound: number; // by how much refining the tetrahedra that a surface passes can change that
  memory: number; // bytes that the worker's core takes
  busy: { updates: number; seconds: number }; // decoded and applied so far, and the time that took
  reconnects: number;
  repeated: number; // updates that came though they were there: never any
}

// A part of the skin: the mesh's boundary, by where it lies. Vertices are kVertexBytes each: x, y, z as float32; then as int8 the normal of length
// 127 in world space (of the surface's triangles around it, or the box's), and as uint8 the level of detail: the scale of the triangles around it, 0 the finest.
// Outward triangles, three uint32 indices each: first those on the alpha surface, then those on beta, then those where the box cuts.
export const kVertexBytes = 16;
export interface Piece {
  id: number;
  vertices: ArrayBuffer;
  indices: ArrayBuffer;
  edges: ArrayBuffer | null; // two uint32 indices each, every edge once; in the same three groups
  triangles: [number, number, number]; // how many of each group
  edgeCounts: [number, number, number];
  min: Vec3; // bounds of its vertices
  max: Vec3;
}

// The next state of the skin: these pieces take the place of those with the same ids, and what is removed goes, all at the same time, or there would be
// cracks. Pieces without triangles are among the removed.
export interface Skin {
  version: number;
  reset: boolean; // all pieces before go
  pieces: Piece[];
  removed: number[];
}

// Where a plane cuts the mesh: the cut through each tetrahedron as triangles by themselves (no indices), 16 bytes a vertex: x, y, z as float32; then
// three uint8, the distance from the triangle's sides opposite to each corner, 255 or 0, sides that are none of the cut tetrahedron's having 255 at all
// corners; and as uint8 the level of detail. Which skin it was made with: version.
export interface Cap {
  plane: Plane | null;
  vertices: ArrayBuffer;
  triangles: number;
  version: number;
}

// Tetrahedra whose middles lie in the box, as they are: four vertices each, 28 bytes: x, y, z and the middle's x, y, z as float32, so that they can be
// shrunken while they are drawn; then uint8 surface (0 inside, 1 alpha, 2 beta), uint8 level of detail, two of padding. Three uint32 indices for each
// of the four outward triangles.
export interface Tets {
  box: Box | null;
  vertices: ArrayBuffer;
  indices: ArrayBuffer;
  count: number;
  outOf: number; // in the box: count, or more where they are too many
}
