// The keys (value_format.h) of a volume's samples, at the centres of diamonds.
#pragma once

#include <array>
#include <cstdint>
#include <functional>

#include "common/diamond/supercube.h"
#include "common/ivm/value_keys.h"
#include "common/patch/volume.h"
#include "server/builder/sample_view.h"

namespace intervale {

// The keys at the centres of a set's diamonds, clamped to the box (domain.h), by number. keys: as many as the set has.
// format: chosen for this volume (value_steps.h). Uses all cores that oneTBB may.
void find_keys(const Volume& volume, const ValueFormat& format, const SupercubeSet& set, ValueKeys& keys);

// The same, of some slots of each supercube, a bit each. The keys of the others stay.
using SlotFilter = std::function<std::uint64_t(SupercubeKey supercube)>;
void find_keys(const SampleView& view, const ValueFormat& format, const SupercubeSet& set, ValueKeys& keys, const SlotFilter& wanted);

// The keys at the root's vertices, in local order.
[[nodiscard]] std::array<ValueKey, kRootVertices> corner_keys(const Volume& volume, const ValueFormat& format);

// If the format has a table: removes the values that are no key's, but for the least and the greatest one, and gives the
// keys their new numbers.
void drop_unused_values(ValueFormat& format, std::array<ValueKey, kRootVertices>& corners, ValueKeys& keys);

// Whether every sample is the value of its key.
[[nodiscard]] bool has_exact_values(const Volume& volume, const ValueFormat& format);

}  // namespace intervale
