// Names of diamonds on the wire: supercubes by bricks, and slots. PROTOCOL.md has the layout.
//
// A scale's bricks are named by the steps from one to the next, and their supercubes one by one: what is likely depends
// on how many of the three neighbours that were there before are named.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/codec/range_coder.h"
#include "common/diamond/supercube.h"
#include "common/util/result.h"

namespace intervale {

// Codes the supercubes of groups with ascending keys. is_plain: without models.
void encode_supercubes(RangeEncoder& coder, bool is_plain, std::span<const SlotGroup> groups);
// The bits that this takes without models: at most 116 for each brick, and 20.
[[nodiscard]] std::size_t plain_supercube_bits(std::span<const SlotGroup> groups);

// Takes them off bytes from outside: at most `most`, ascending. Allocates no more than a few bytes for each of those.
[[nodiscard]] Result<std::vector<SupercubeKey>> decode_supercubes(RangeDecoder& coder, bool is_plain, std::size_t most);

// The names of split diamonds: supercubes and slots. Groups read have only key and slots; slots are not 0 and within
// kSlots.
[[nodiscard]] std::vector<std::uint8_t> encode_splits(std::span<const SlotGroup> groups);
[[nodiscard]] Result<std::vector<SlotGroup>> decode_splits(std::span<const std::uint8_t> bytes, std::size_t most);

}  // namespace intervale
