// The colours of surfaces, sRGB.

export type SurfaceName = 'alpha' | 'beta' | 'box';
export const kSurfaces: readonly SurfaceName[] = ['alpha', 'beta', 'box']; // the order of the groups in a SurfacePiece

// Of one range.
export const kSurfaceColors: Readonly<Record<SurfaceName, string>> = { alpha: '#3d7fd6', beta: '#f0862a', box: '#d8c49a' };

// Of several, one each: blue, orange, green and purple, told apart also by people who see few colours.
export const kRangeColors: readonly string[] = ['#3d7fd6', '#e69f00', '#009e73', '#cc79a7'];
