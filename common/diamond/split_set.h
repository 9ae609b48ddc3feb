// The split diamonds as a set of updates.
//
// Which slots of a supercube are split is a word of 56 bits, and few of these words occur: what a view needs follows
// surfaces, from coarse to fine, so that 100 clients of a data set have 20,000 different words in a million supercubes.
// A word is kept once for all sets of the process, and each set has 16 bits for it.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

#include "common/diamond/supercube.h"
#include "common/util/interned_words.h"

namespace intervale {

// A set of updates, each named by its brick, supercube and slot. Memory: eight bytes for each 32 bricks; some 30 more
// if any of these has one in the set; ten for each brick that has; and, for each supercube that has, two once it is
// settled, and ten before, or where more different words are in use than have numbers.
class SplitSet {
 public:
  SplitSet() = default;  // of no bricks
  explicit SplitSet(std::size_t bricks) : pages_((bricks + kPage - 1) / kPage) {}
  explicit SplitSet(const SupercubeSet& set) : SplitSet(set.bricks().size()) {}
  SplitSet(const SplitSet& other);
  SplitSet& operator=(const SplitSet& other) { return *this = SplitSet(other); }
  SplitSet(SplitSet&&) noexcept = default;
  SplitSet& operator=(SplitSet&&) noexcept = default;
  ~SplitSet() = default;

  // The slots of a supercube that are in it; inserts and erases some. Of the key, only its place in the brick counts.
  [[nodiscard]] std::uint64_t slots(BrickIndex brick, SupercubeKey key) const {
    const Record record = find(brick);
    if (record.at == nullptr) return 0;
    const std::uint64_t here = record.supercubes();
    const auto place = int(key % 64);
    return (here >> place & 1) == 0 ? 0 : record.word(count_below(here, place));
  }
  void insert(BrickIndex brick, SupercubeKey key, std::uint64_t slots) {
    const std::uint64_t had = this->slots(brick, key);
    if ((slots & ~had) != 0) set(brick, key, had | slots);
  }
  void erase(BrickIndex brick, SupercubeKey key, std::uint64_t slots) {
    const std::uint64_t had = this->slots(brick, key);
    if ((slots & had) != 0) set(brick, key, had & ~slots);
  }
  [[nodiscard]] bool contains(const Place& p) const { return (slots(p.brick, p.key) >> p.slot & 1) != 0; }
  void insert(const Place& p) { insert(p.brick, p.key, std::uint64_t(1) << p.slot); }
  void erase(const Place& p) { erase(p.brick, p.key, std::uint64_t(1) << p.slot); }

  // Whether a brick has any, or had since it was settled. The same of 64 bricks from `begin` on, a bit each; begin: a
  // multiple of 64.
  [[nodiscard]] bool has_any(BrickIndex brick) const { return find(brick).at != nullptr; }
  [[nodiscard]] std::uint64_t bricks(std::size_t begin) const;
  // How many updates are in it: of a brick, or all.
  [[nodiscard]] unsigned count(BrickIndex brick) const;
  [[nodiscard]] std::uint64_t count() const;
  [[nodiscard]] std::vector<SlotGroup> groups(const SupercubeSet& set) const;  // all of it, in order

  // Replaces the words of the set's own by numbers, unless fewer than `most` came since the last time. O(the bricks of
  // the pages that were changed).
  void settle(std::size_t most = 0);
  [[nodiscard]] std::size_t memory_bytes() const {  // with the allocator's
    return pages_.capacity() * sizeof pages_[0] + changed_.capacity() * sizeof changed_[0] + block_bytes_;
  }
  friend bool operator==(const SplitSet& a, const SplitSet& b);

 private:
  // Of a page of bricks, if any has a record: a bit for each brick, whether it has; in two bytes each, how many times
  // 16 bytes the block takes, and where its last record ends, with the highest bit set if the page is in changed_; in
  // two bytes for each record, where it begins; the records. A record: a bit for each supercube of the brick, by its
  // place, whether it is here; for each that is the number of its word, which the block uses, or kOwn and more, for a
  // word of the record's own; those words.
  static constexpr std::size_t kPage = 32, kHead = 8;
  using Number = InternedWords::Number;
  static constexpr Number kOwn = InternedWords::kLimit;
  static InternedWords words;  // of all sets
  struct Release {
    void operator()(std::uint8_t* block) const;
  };
  using Block = std::unique_ptr<std::uint8_t[], Release>;

  template <class T>
  [[nodiscard]] static T load(const std::uint8_t* from) {
    T value;
    std::memcpy(&value, from, sizeof value);
    return value;
  }
  struct Record {
    const std::uint8_t* at = nullptr;  // null: there is none
    [[nodiscard]] std::uint64_t supercubes() const { return load<std::uint64_t>(at); }
    // Of a supercube; n: how many of supercubes() come before.
    [[nodiscard]] Number number(int n) const { return load<Number>(at + 8 + 2 * n); }
    [[nodiscard]] std::uint64_t word(int n) const {
      const Number number = this->number(n);
      return number < kOwn ? words[number] : load<std::uint64_t>(at + own_word(number));
    }
    // Where a word of its own is in the record.
    [[nodiscard]] std::size_t own_word(Number number) const {
      return 8 + 2 * std::size_t(std::popcount(supercubes())) + 8 * std::size_t(number - kOwn);
    }
  };
  [[nodiscard]] Record find(BrickIndex brick) const {
    const std::uint8_t* const block = pages_[brick / kPage].get();
    if (block == nullptr) return {};
    const auto here = load<std::uint32_t>(block);
    if ((here >> (brick % kPage) & 1) == 0) return {};
    return {block + load<std::uint16_t>(block + kHead + 2 * count_below(here, int(brick % kPage)))};
  }
  // Calls visit(brick, place, record, n) for each supercube of a block, in order; brick: its number in the page. block:
  // may be null.
  template <class Visit>
  static void for_each_in(const std::uint8_t* block, Visit&& visit);
  void set(BrickIndex brick, SupercubeKey key, std::uint64_t word);
  std::uint8_t* prepare_change(std::size_t page);

  std::vector<Block> pages_;
  std::vector<std::uint32_t> changed_;  // pages, since it was settled
  std::size_t own_words_ = 0;           // that came since
  std::size_t block_bytes_ = 0;
};

}  // namespace intervale
