// The keys at the vertices of diamonds, from an interval volume.
#pragma once

#include "common/codec/value_prediction.h"
#include "common/diamond/supercube_neighbours.h"
#include "common/ivm/interval_volume.h"

namespace intervale {

// The keys at the vertices of the diamond in a slot, all of whose parents are in the volume; vertices that do not exist
// get what fill_missing() gives them. around: at the diamond's supercube.
void gather_vertex_keys(const IntervalVolume& volume, SetNeighbours& around, Slot slot, VertexKeys& keys);

}  // namespace intervale
