// The messages between the page and its worker. The worker holds the connection, the client core and the mesh; the page
// draws.
//
// Positions are in samples (0 at the first, dims - 1 at the last) unless said otherwise, so that float32 is precise
// enough; the data set's affine takes them to the world. Cameras, planes and boxes are in world coordinates.
import type { Pose } from './camera.js';

export type Vec3 = [number, number, number];

// 3 x 4 numbers, row by row: world = A * position + t, where A is the first three columns and t the fourth. A may turn,
// shear and mirror.
export type Affine = [number, number, number, number, number, number, number, number, number, number, number, number];

export interface Box {
  min: Vec3;
  max: Vec3;
}

// What lies on the normal's side, dot(normal, p) > offset, is cut away. normal: of length 1.
export interface Plane {
  normal: Vec3;
  offset: number;
}

export type MeshFormat = 'vtu' | 'stl' | 'glb';

// From the page to the worker.
export type Request =
  | { type: 'load'; wasmUrl: string | null } // the first: loads the core; null: from where it lies beside the worker
  // Ends an open session; the next 'view' connects. to: the address of the WebSocket, "ws://host:port/v1/stream", or
  // the port of a LocalDataset.
  | { type: 'open'; to: string | MessagePort; dataset: string; token?: string }
  // The view that is wanted from now on. With a region: that at full detail. Without: everything, until the error is at
  // most pixelError on the camera's screen. Nothing before 'open'.
  | { type: 'view'; view: View; number: number } // number: for Progress.view
  // Shown until the next 'view', of what was received; the server is not asked. If all of it would take too long, the
  // ranges that differ from the view's are coarser. Answered by a report of the same type once its surface was sent,
  // which the page's showing of the last one precedes; or without one where there is no mesh, or a 'view' came before.
  | { type: 'preview'; ranges: [number, number][] }
  // Each is answered by a Cap; if a new one arrives before the answer, only the last is answered.
  | { type: 'clip'; plane: Plane | null }
  | { type: 'tets'; box: Box | null } // from now on, after each change of the mesh: the tetrahedra in this box
  | { type: 'edges'; wanted: boolean } // whether pieces have edges
  | { type: 'values'; wanted: boolean } // whether pieces, caps and tetrahedra have values: those of the view's channel, or the field's
  | { type: 'volume'; wanted: boolean } // from now on, after each change of the mesh: all tetrahedra, for which values must be wanted, too; after each 'view', their order
  // From now on, whenever the mesh rests: a coarser surface, with at most so many triangles, to draw while the camera moves;
  // null: none is wanted.
  | { type: 'standIn'; triangles: number | null }
  | { type: 'shown'; version: number } // the page shows this version of the surface, so the next may be made
  | { type: 'probe'; at: Vec3 } // answered by a report 'probed'
  | { type: 'save'; format: MeshFormat }
  | { type: 'digest' }; // answered by a report of the same type

// To the worker of a file, and its answer to the first, which is loading. Each port is that of a session.
export type LocalRequest =
  | { type: 'load'; file: Blob | string; name: string; wasmUrl: string | null } // file: or its address; name: the data set's; wasmUrl: of local.wasm; null: from where it lies beside the worker
  | { type: 'connect'; port: MessagePort };
export type LocalReply =
  | { type: 'received'; received: number; size: number | null } // of a file at an address, bytes; also after 'loaded'; size: null if not known
  | { type: 'loaded'; description: string } // there is something to see; the rest may follow
  | { type: 'error'; text: string }; // after 'loaded': the rest cannot be had

export interface View {
  camera: Pose & { viewport: [number, number] }; // viewport: device pixels
  ranges: [number, number][]; // of values, four at most; a mesh is made for each; none: the data set's own
  uniform: boolean; // whether the inside of the ranges is refined, too, and not only their surfaces; the data set must have it
  channel: string | null; // of the data set, whose values come along; null: none
  probed: string[]; // other channels whose values come along, for 'probe'
  pixelError: number; // largest screen-space error, pixels; above 0
  region: Box | null; // outside it the mesh is as coarse as conformity allows, whatever was received
  opaque: boolean; // whether surfaces hide what is behind them, and nothing is cut away: what they hide is sent last
  maxTets: number | null; // in the mesh; null: no limit
  maxUpdates: number | null; // kept in memory, about 30 bytes each on the server; null: no limit
}

// From the worker to the page.
export type Report =
  | { type: 'palettes'; palettes: Palette[] } // once, when the core has been loaded; the default first
  | { type: 'connection'; state: ConnectionState }
  | { type: 'opened'; resumed: boolean } // resumed: the mesh is kept and the stream continues
  | { type: 'progress'; progress: Progress }
  | { type: 'surface'; change: SurfaceChange }
  // To replace the last stand-in; its version counts stand-ins. null: that fits no more, or the mesh has no more triangles
  // than are wanted. Without cracks, of the mesh as it was a moment ago.
  | { type: 'standIn'; change: SurfaceChange | null }
  | { type: 'cap'; cap: Cap }
  | { type: 'tets'; tets: Tets }
  | { type: 'volume'; volume: Volume }
  | { type: 'order'; version: number; order: ArrayBuffer } // another order of the volume of this version; see Volume
  | { type: 'preview' }
  // Interpolated at a point of the world, in the mesh's tetrahedron there: of the field, then of the data set's
  // channels in their order, of a vector the length; NaN where values did not come along. null: outside of the box, or
  // there is no mesh.
  | { type: 'probed'; at: Vec3; values: number[] | null }
  | { type: 'saved'; format: MeshFormat; name: string; bytes: ArrayBuffer }
  | { type: 'digest'; digest: string; updates: number; tets: number }
  | { type: 'error'; text: string }; // for the user; the session is closed

// 256 colours, red, green and blue, a byte each, sRGB; the first is that of the least value.
export interface Palette {
  name: string;
  colours: ArrayBuffer;
}

export type ConnectionState =
  | { state: 'connecting' }
  | { state: 'open' }
  | { state: 'waiting'; seconds: number; attempt: number; reason: string } // lost; the next attempt is in `seconds`
  | { state: 'closed' };

export interface Progress {
  view: number; // the number of the last 'view'; 0: it had none
  bytes: number; // received, of messages
  updates: number; // received
  updatesInMesh: number; // those that change the surfaces, and their ancestors
  updatesShown: number; // fewer than received where the budget of tetrahedra or the region leaves some out
  tets: number; // of the mesh
  triangles: number; // of the boundary surface
  updatesToGo: number; // upper bound for this view; 0 when done
  remainingError: number; // field units
  remainingPixels: number; // screen-space error, pixels
  surfaceVersion: number; // of the last boundary surface sent to the page
  done: boolean; // all that this view wants was received, and is in that surface
  full: boolean; // the memory budget leaves some updates out
  volumes: number[]; // of the mesh of each range, cubic world units
  volumeBound: number | null; // the most by which refining the tetrahedra on the surfaces can change their sum; null: not known until done
  memory: number; // of the core, bytes
  busy: { updates: number; seconds: number }; // updates decoded and applied, and the time for it
  reconnects: number;
  repeated: number; // updates received more than once; 0 unless the server has a defect
}

// The triangles of the boundary surface of one range's mesh in one part of the data's box. 16 bytes per vertex: x, y, z
// as float32; the normal in world space as int8 of length 127 (averaged over the triangles of the vertex's own surface,
// or that of the box's face); the level of detail as uint8: the scale of the triangles around it, 0 the finest.
// Triangles: three uint32 indices, counterclockwise seen from outside in the world; first those on the alpha surface,
// then those on beta, then those on the faces of the data's box.
export interface SurfacePiece {
  id: number; // no other range has it
  range: number; // index among those shown
  vertices: ArrayBuffer;
  values: ArrayBuffer | null; // at each vertex, float32; of a vector the length; null unless wanted
  indices: ArrayBuffer;
  edges: ArrayBuffer | null; // two uint32 indices each, every edge once per group; in the same three groups
  triangles: [number, number, number]; // per group
  edgeCounts: [number, number, number];
  min: Vec3; // bounds of the vertices
  max: Vec3;
}

// The change to the next version of the boundary surface: `pieces` replace those of the same ids, and `removed` are
// deleted. To be shown as a whole, or there would be cracks. A piece without triangles is in `removed`.
export interface SurfaceChange {
  version: number; // from 1
  hasValues: boolean; // all pieces have, also those from earlier changes
  ranges: number; // how many are shown
  reset: number[]; // ranges: delete all their earlier pieces first
  pieces: SurfacePiece[];
  removed: number[]; // ids
}

// The section of the meshes by a plane: each tetrahedron's as triangles without indices. 16 bytes per vertex: x, y, z as
// float32; three uint8, one per side of the triangle: 255 at the opposite corner, 0 on the side; 255 at all corners for
// a side that is not an edge of the tetrahedron's section; the level of detail as uint8.
export interface Cap {
  plane: Plane | null;
  vertices: ArrayBuffer;
  values: ArrayBuffer | null; // as in a SurfacePiece
  triangles: number[]; // of each range, in their order
  version: number; // of the boundary surface made from the same mesh
}

// The tetrahedra whose centres lie in a box. Four vertices each, 28 bytes per vertex: x, y, z and the tetrahedron's
// centre as float32, so that shaders can shrink it; surface as uint8 (0 inside, 1 alpha, 2 beta); level of detail as
// uint8; the index of the range as uint8; a byte of padding.
export interface Tets {
  box: Box | null;
  vertices: ArrayBuffer;
  values: ArrayBuffer | null; // as in a SurfacePiece
  count: number;
  outOf: number; // tetrahedra in the box: more than count where they are too many to show
}

// All tetrahedra. 16 bytes per point: x, y, z and the field's value as float32. 16 bytes per tetrahedron: four uint32,
// numbers of points, of which the first has the index of the range in its upper two bits; positive in the world.
export interface Volume {
  version: number; // of the boundary surface made from the same mesh
  points: ArrayBuffer;
  tets: ArrayBuffer;
  order: ArrayBuffer; // uint32: all tetrahedra, the farthest from the view's camera first
}
