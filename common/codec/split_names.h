// Names of diamonds on the wire: supercubes by bricks, and slots. PROTOCOL.md has the layout.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/diamond/supercube.h"
#include "common/util/result.h"

namespace intervale {

// Appends the supercubes of groups with ascending keys.
void append_supercubes(std::vector<std::uint8_t>& out, std::span<const SlotGroup> groups);

// Takes them off the front of bytes from outside: at most `most`, ascending. Allocates no more than a few bytes for
// each of those.
[[nodiscard]] Result<std::vector<SupercubeKey>> take_supercubes(std::span<const std::uint8_t>& bytes, std::size_t most);

// The names of split diamonds: supercubes and slots. Groups read have only key and slots; slots are not 0 and within
// kSlots.
[[nodiscard]] std::vector<std::uint8_t> encode_splits(std::span<const SlotGroup> groups);
[[nodiscard]] Result<std::vector<SlotGroup>> decode_splits(std::span<const std::uint8_t> bytes, std::size_t most);

}  // namespace intervale
