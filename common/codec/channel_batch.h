// The values of channels in a batch. channel_encoder.h writes them and channel_values.h takes them; PROTOCOL.md has the
// layout.
//
// They are coded like the values of the field, in the order in which updates are applied. A client gets the values of a
// channel for diamonds that it has split: those that the batch splits, or had split before. Both sides know which those
// are, so no flags are needed. A vertex counts as known if the client has the channel's value there.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "common/codec/batch.h"
#include "common/codec/range_coder.h"
#include "common/diamond/domain.h"
#include "common/diamond/supercube_neighbours.h"
#include "common/patch/channel.h"
#include "common/util/bits.h"

namespace intervale {

// The keys of a channel's components.
using ComponentKeys = std::array<ValueKey, kMaxComponents>;

// Codes one channel at the diamonds of these groups (keys strictly ascending). Coder: a RangeEncoder or a RangeDecoder.
// Values say what is known of the channel:
//   void move_to(const SlotGroup& group)
//   bool at_vertex(Link link, ComponentKeys& keys)   at a vertex of one of its diamonds that is no corner of the domain;
//                                                    false if there is no value
//   void code(Slot slot, ComponentKeys& keys)        gives an encoder the keys at the centre of the diamond in a slot;
//                                                    keeps what a decoder found there
// False if what was decoded is no batch: an end of a spine has no value, or a key is out of range.
template <class Coder, class Values>
bool code_channel(Coder& coder, bool is_plain, const Channel& channel, const Domain& domain, std::span<const SlotGroup> groups, Values& values) {
  constexpr bool kDecodes = std::is_same_v<Coder, RangeDecoder>;
  const std::size_t components = channel.components.size();
  const auto models = std::make_unique<std::array<BatchModels, kMaxComponents>>();
  for (BatchModels& model : *models) model.is_plain = is_plain;
  bool is_valid = true;
  std::array<VertexKeys, kMaxComponents> around{};
  // Gathers the keys at a diamond's vertices.
  const auto gather = [&](const Diamond& d, const Links& links) {
    for (int v = 0; v < d.row->vertices; ++v) {
      ComponentKeys keys{kNoKey, kNoKey, kNoKey};
      const int corner = domain.corner_number(d.vertex(v));
      if (corner >= 0) {
        for (std::size_t c = 0; c < components; ++c) keys[c] = channel.components[c].corners[std::size_t(corner)];
      } else if (!values.at_vertex(links.vertex[std::size_t(v)], keys) && v < 2) {
        return false;
      }
      for (std::size_t c = 0; c < components; ++c) around[c][std::size_t(v)] = keys[c];
    }
    for (std::size_t c = 0; c < components; ++c) fill_missing(around[c], d.row->vertices);
    return true;
  };
  for_each_class(
      groups.size(), [&](std::size_t g) { return groups[g].key; },
      [&](std::size_t g, int cls) {
        const std::uint64_t slots = groups[g].slots & kSlotsOfClass[std::size_t(cls)];
        if (slots == 0) return true;
        const int scale = scale_of_key(groups[g].key);
        const Links* const links = link_table()[parity_of(position_of_key(groups[g].key))].data();
        values.move_to(groups[g]);
        for (const Slot slot : set_bits<Slot>(slots)) {
          is_valid = is_valid && gather(Diamond(centre_of(groups[g].key, slot), scale, kTypeOfSlot[slot]), links[slot]);
          if (!is_valid) return false;
          ComponentKeys keys{};
          if constexpr (!kDecodes) values.code(slot, keys);
          for (std::size_t c = 0; c < components; ++c) {
            const ChannelComponent& component = channel.components[c];
            const ValueKey last = component.format.last;
            const PredictedValue predicted = predict_value(cls, scale, around[c], component.weights, last);
            keys[c] = (*models)[c].code_key(coder, cls, scale, predicted, last, keys[c]);
            is_valid = is_valid && keys[c] <= last;
          }
          if constexpr (kDecodes) {
            is_valid = is_valid && !coder.is_overdrawn();
            if (!is_valid) return false;
            values.code(slot, keys);
          }
        }
        return true;
      });
  return is_valid;
}

}  // namespace intervale
