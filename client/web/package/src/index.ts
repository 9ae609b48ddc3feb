// Multiresolution interval volumes that refine while they are received: typed arrays for any engine.
export { axes, fitted, kFov, orbited, panned, type Pose, projected, rayThrough, rolled, zoomed } from './camera.js';
export { kRangeColors, kSurfaceColors, kSurfaces, type SurfaceName } from './colors.js';
export { boxVolume, type ChannelInfo, type Dataset, fetchStatistics, listDatasets, type Listing, type Statistics, streamUrl } from './datasets.js';
export { type Told } from './file_source.js';
export { type Frame, frameOf } from './frame.js';
export { LocalDataset, type LocalOptions } from './local_dataset.js';
export { addressOf, describe, LiveMesh, type LiveMeshEvents, type LiveMeshOptions, surfacesOf, updatesIn, viewOf, type Wanted } from './live_mesh.js';
export type * from './messages.js';
export { arraysOf, type PieceArrays } from './pieces.js';
export { type Range, rangeOf, spanOf } from './ranges.js';
