// Channels of volumes made by formula.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "common/front/channel_values.h"
#include "common/ivm/interval_volume.h"
#include "server/builder/channel_builder.h"
#include "server/volume/read_volume.h"
#include "tests/support/analytic_fields.h"

namespace intervale::testing {

// Whole numbers from 0 to `most` at each sample, independent of each other.
inline Volume noise(const std::array<std::int32_t, 3>& dims, unsigned components, int most, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::int16_t> f(components * std::size_t(dims[0]) * std::size_t(dims[1]) * std::size_t(dims[2]));
  for (auto& v : f) v = std::int16_t(int(random() % unsigned(most + 1)));
  Volume volume = volume_of_type(SampleType::i16, dims, f);
  volume.components = components;
  return volume;
}

// The sample's own place: x, y and z.
inline Volume places(const std::array<std::int32_t, 3>& dims) {
  std::vector<float> f;
  for (int z = 0; z < dims[2]; ++z) {
    for (int y = 0; y < dims[1]; ++y) {
      for (int x = 0; x < dims[0]; ++x) f.insert(f.end(), {float(x), float(y), float(z)});
    }
  }
  Volume volume = volume_of_type(SampleType::f32, dims, f);
  volume.components = 3;
  return volume;
}

struct NamedVolume {
  std::string name;
  Volume volume;
};

// Gives an interval volume these channels.
inline void set_channels(IntervalVolume& to, const std::vector<NamedVolume>& named) {
  std::vector<Channel> channels;
  std::vector<ChannelKeys> keys;
  for (const NamedVolume& one : named) {
    auto built = build_channel(one.volume, one.name, {}, to.set()).value();
    channels.push_back(std::move(built.channel));
    keys.push_back(std::move(built.keys));
  }
  if (!to.set_channels(std::move(channels), std::move(keys))) std::abort();
}

// A scalar of noise, and the places.
inline void set_channels(IntervalVolume& to, unsigned seed) {
  const auto& dims = to.description().grid.dims;
  set_channels(to, {{"noise", noise(dims, 1, 300, seed)}, {"place", places(dims)}});
}

// The first value held that is not the volume's, or that is held where the front has no split; empty if there is none.
inline std::string wrong_value(const ChannelValues& held, const Volume& volume, const Front& front) {
  const Domain domain(volume.grid.dims);
  const MeshChannel channel = held.for_mesh();
  std::array<double, kMaxComponents> values{};
  std::vector<Volume> components;
  for (unsigned k = 0; k < channel.components; ++k) components.push_back(component_of(volume, k));
  for (const SlotGroup& group : held.groups()) {
    const FrontState::Block* const block = front.state().find_block(scale_of_key(group.key), position_of_key(group.key));
    if (block == nullptr || (group.slots & ~block->split) != 0) return "a value where nothing is split";
    for (const Slot slot : set_bits<Slot>(group.slots)) {
      const Vertex c = centre_of(group.key, slot), s = domain.clamp(c);
      channel.values_at(c, std::span(values).first(channel.components));
      for (unsigned k = 0; k < channel.components; ++k) {
        if (values[k] != sample(components[k], s.x, s.y, s.z)) return "a wrong value of " + channel.name;
      }
    }
  }
  return {};
}

}  // namespace intervale::testing
