#include "common/front/slot_array.h"

#include <algorithm>

namespace intervale {

std::uint8_t* SlotBytes::obtain(std::size_t slot, std::size_t bytes) {
  if (has(slot)) return at(slot);
  bytes_per_ = std::uint8_t(bytes);
  const auto size = std::size_t(std::popcount(slots_)), place = std::size_t(count_below(slots_, int(slot)));
  slots_ |= std::uint64_t(1) << slot;
  if (size < capacity_) {
    std::uint8_t* const to = bytes_.get() + place * bytes;
    std::memmove(to + bytes, to, (size - place) * bytes);
    return to;
  }
  capacity_ = std::uint8_t(std::min(std::size_t(kSlots), size + kGrowth));
  auto grown = std::make_unique<std::uint8_t[]>(memory_bytes());
  if (size != 0) {
    std::memcpy(grown.get(), bytes_.get(), place * bytes);
    std::memcpy(grown.get() + (place + 1) * bytes, bytes_.get() + place * bytes, (size - place) * bytes);
  }
  bytes_ = std::move(grown);
  return bytes_.get() + place * bytes;
}

void SlotBytes::reshape(std::uint64_t slots, std::size_t bytes) {
  if (slots == slots_) return;
  SlotBytes to;
  to.slots_ = slots;
  to.bytes_per_ = std::uint8_t(bytes);
  to.capacity_ = std::uint8_t(std::popcount(slots));
  if (slots != 0) to.bytes_ = std::make_unique<std::uint8_t[]>(to.memory_bytes());
  for (const int slot : set_bits(slots & slots_)) std::memcpy(to.at(std::size_t(slot)), at(std::size_t(slot)), bytes);
  *this = std::move(to);
}

void SlotBytes::replace(std::uint64_t slots, std::size_t bytes) {
  const auto size = std::size_t(std::popcount(slots));
  if (bytes != bytes_per_ || size > capacity_ || 2 * size < capacity_) {
    bytes_per_ = std::uint8_t(bytes);
    capacity_ = std::uint8_t(size);
    bytes_ = size == 0 ? nullptr : std::make_unique<std::uint8_t[]>(memory_bytes());
  }
  slots_ = slots;
}

}  // namespace intervale
