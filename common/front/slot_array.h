// Arrays by slot of one supercube, in which only the slots that were set take memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>

#include "common/diamond/supercube.h"
#include "common/patch/value_format.h"
#include "common/util/bits.h"

namespace intervale {

// Elements of a fixed number of bytes, in order of their slots.
class SlotBytes {
 public:
  SlotBytes() = default;
  SlotBytes(const SlotBytes& other) { *this = other; }
  SlotBytes(SlotBytes&&) noexcept = default;
  SlotBytes& operator=(const SlotBytes& other) {
    if (this == &other) return *this;
    slots_ = other.slots_;
    bytes_per_ = other.bytes_per_;
    capacity_ = std::uint8_t(std::popcount(slots_));
    bytes_ = capacity_ == 0 ? nullptr : std::make_unique<std::uint8_t[]>(memory_bytes());
    if (capacity_ != 0) std::memcpy(bytes_.get(), other.bytes_.get(), memory_bytes());
    return *this;
  }
  SlotBytes& operator=(SlotBytes&&) noexcept = default;
  ~SlotBytes() = default;

  [[nodiscard]] std::uint64_t slots() const { return slots_; }  // that were set
  [[nodiscard]] bool has(std::size_t slot) const { return (slots_ >> slot & 1) != 0; }
  [[nodiscard]] std::size_t bytes_per() const { return bytes_per_; }  // of an element
  [[nodiscard]] std::size_t memory_bytes() const { return std::size_t(capacity_) * bytes_per_; }

  // The element of a slot that was set.
  [[nodiscard]] const std::uint8_t* at(std::size_t slot) const { return bytes_.get() + std::size_t(count_below(slots_, int(slot))) * bytes_per_; }
  [[nodiscard]] std::uint8_t* at(std::size_t slot) { return bytes_.get() + std::size_t(count_below(slots_, int(slot))) * bytes_per_; }
  // The same; if the slot was not set, its element is new and of any value. bytes: of an element, always the same.
  std::uint8_t* obtain(std::size_t slot, std::size_t bytes);
  // Keeps the elements of `slots` and no others; those that were not set are new.
  void reshape(std::uint64_t slots, std::size_t bytes);
  // Elements of any value for `slots`, and no others. In the memory it has, if it needs half of that or more.
  void replace(std::uint64_t slots, std::size_t bytes);

 private:
  static constexpr std::size_t kGrowth = 8;  // elements
  std::uint64_t slots_ = 0;
  std::unique_ptr<std::uint8_t[]> bytes_;
  std::uint8_t bytes_per_ = 0, capacity_ = 0;
};

// Keys, in as many bytes each as the greatest one needs: 1, 2 or 4.
class SlotKeys {
 public:
  [[nodiscard]] static std::size_t width(ValueKey last) { return last < 1u << 8 ? 1 : last < 1u << 16 ? 2 : 4; }
  // Of a slot that was set.
  [[nodiscard]] ValueKey operator[](std::size_t slot) const { return load(bytes_.at(slot)); }
  void set(std::size_t slot, ValueKey key, ValueKey last) { store(bytes_.obtain(slot, width(last)), key); }
  // Replaces all: keys[slot] for each of `slots`.
  void assign(std::uint64_t slots, const std::array<ValueKey, kSlots>& keys, ValueKey last) {
    bytes_.replace(slots, width(last));
    std::uint8_t* to = slots == 0 ? nullptr : bytes_.at(std::size_t(std::countr_zero(slots)));
    for (const int slot : set_bits(slots)) {
      store(to, keys[std::size_t(slot)]);
      to += bytes_.bytes_per();
    }
  }
  // A bit for each slot that was set whose key is not less than `first`.
  [[nodiscard]] std::uint64_t at_least(std::uint64_t first) const {
    std::uint64_t mask = 0;
    const std::uint64_t slots = bytes_.slots();
    const std::uint8_t* from = slots == 0 ? nullptr : bytes_.at(std::size_t(std::countr_zero(slots)));
    for (const int slot : set_bits(slots)) {
      mask |= std::uint64_t(load(from) >= first) << slot;
      from += bytes_.bytes_per();
    }
    return mask;
  }
  [[nodiscard]] std::size_t memory_bytes() const { return bytes_.memory_bytes(); }

 private:
  [[nodiscard]] ValueKey load(const std::uint8_t* at) const {
    if (bytes_.bytes_per() == 1) return *at;
    if (bytes_.bytes_per() == 2) {
      std::uint16_t key = 0;
      std::memcpy(&key, at, sizeof key);
      return key;
    }
    ValueKey key = 0;
    std::memcpy(&key, at, sizeof key);
    return key;
  }
  void store(std::uint8_t* at, ValueKey key) const {
    if (bytes_.bytes_per() == 1) {
      *at = std::uint8_t(key);
    } else if (bytes_.bytes_per() == 2) {
      const auto narrow = std::uint16_t(key);
      std::memcpy(at, &narrow, sizeof narrow);
    } else {
      std::memcpy(at, &key, sizeof key);
    }
  }
  SlotBytes bytes_;
};

}  // namespace intervale
