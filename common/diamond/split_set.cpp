#include "common/diamond/split_set.h"

#include <algorithm>
#include <array>
#include <new>

namespace intervale {
namespace {

constexpr std::size_t kUnits = 4, kEnd = 6;              // where the block's two numbers are
constexpr std::uint16_t kChanged = 0x8000;               // in the second
constexpr std::size_t kUnit = 16, kAllocator = 8;        // an allocator takes multiples, at least two, and for itself
constexpr std::size_t kMostOfRecord = 8 + 64 * (2 + 8);  // bytes
constexpr std::size_t kMostAdded = 2 + 8 + 2 + 8;        // bytes that a change may add to a block

template <class T>
void store(std::uint8_t* to, T value) {
  std::memcpy(to, &value, sizeof value);
}

std::uint16_t load16(const std::uint8_t* from) {
  std::uint16_t value = 0;
  std::memcpy(&value, from, sizeof value);
  return value;
}

// Bytes of a block, with the allocator's.
std::size_t bytes_of(const std::uint8_t* block) { return load16(block + kUnits) * kUnit; }
std::uint16_t end_of(const std::uint8_t* block) { return std::uint16_t(load16(block + kEnd) & ~kChanged); }

// Units of a block with room for so many bytes.
std::size_t units_of(std::size_t bytes) { return std::max<std::size_t>((bytes + kAllocator + kUnit - 1) / kUnit, 2); }

// Memory as an empty block; nullptr: there is none.
std::uint8_t* as_block(std::uint8_t* memory, std::size_t units) {
  if (memory == nullptr) return nullptr;
  store(memory, std::uint32_t(0));
  store(memory + kUnits, std::uint16_t(units));
  return memory;
}
std::uint8_t* new_block(std::size_t units) { return as_block(new std::uint8_t[units * kUnit - kAllocator], units); }

// The contents of a block in another one, which has room for them. Its words are the other one's now.
void move_to(std::uint8_t* to, const std::uint8_t* from) {
  const std::uint16_t units = load16(to + kUnits);
  std::memcpy(to, from, end_of(from));
  store(to + kUnits, units);
}

// Moves what is behind a place of a block.
void open_gap(std::uint8_t* block, std::size_t at, std::size_t bytes) {
  const std::uint16_t end = end_of(block);
  std::memmove(block + at + bytes, block + at, end - at);
  store(block + kEnd, std::uint16_t((end + bytes) | kChanged));
}

}  // namespace

constinit InternedWords SplitSet::words;

template <class Visit>
void SplitSet::for_each_in(const std::uint8_t* block, Visit&& visit) {
  if (block == nullptr) return;
  const std::uint8_t* begin = block + kHead;
  for (const unsigned brick : set_bits<unsigned>(load<std::uint32_t>(block))) {
    const Record record{block + load16(begin)};
    begin += 2;
    int n = 0;
    for (const int place : set_bits(record.supercubes())) visit(brick, place, record, n++);
  }
}

void SplitSet::Release::operator()(std::uint8_t* block) const {
  for_each_in(block, [](unsigned, int, const Record& record, int n) {
    if (record.number(n) < kOwn) words.release(record.number(n));
  });
  delete[] block;
}

SplitSet::SplitSet(const SplitSet& other)
    : pages_(other.pages_.size()), changed_(other.changed_), own_words_(other.own_words_), block_bytes_(other.block_bytes_) {
  for (std::size_t i = 0; i < pages_.size(); ++i) {
    const std::uint8_t* const block = other.pages_[i].get();
    if (block == nullptr) continue;
    std::uint8_t* const copy = new_block(load16(block + kUnits));
    move_to(copy, block);
    for_each_in(block, [](unsigned, int, const Record& record, int n) {
      if (record.number(n) < kOwn) words.use_again(record.number(n));
    });
    pages_[i].reset(copy);
  }
}

// Makes room for a change in a page. Throws if there is no memory, and leaves what is in the set then.
std::uint8_t* SplitSet::prepare_change(std::size_t page) {
  Block& block = pages_[page];
  const std::size_t end = block ? end_of(block.get()) : kHead;
  const std::size_t had = block ? bytes_of(block.get()) : 0;
  if (end + kMostAdded + kAllocator > had) {
    std::uint8_t* const grown = new_block(units_of(end + kMostAdded + end / 16));
    if (block)
      move_to(grown, block.get());
    else
      store(grown + kEnd, std::uint16_t(kHead));
    delete[] block.release();
    block.reset(grown);
    block_bytes_ += bytes_of(grown) - had;
  }
  if ((load16(block.get() + kEnd) & kChanged) == 0) changed_.push_back(std::uint32_t(page));
  store(block.get() + kEnd, std::uint16_t(end | kChanged));
  return block.get();
}

void SplitSet::set(BrickIndex brick, SupercubeKey key, std::uint64_t word) {
  std::uint8_t* const block = prepare_change(brick / kPage);  // nothing fails from here on
  auto here = load<std::uint32_t>(block);
  const int at = int(brick % kPage), before = count_below(here, at);
  const std::size_t begin = kHead + 2 * std::size_t(before);
  const auto move_begins = [&](int from, std::size_t by) {
    for (int n = from; n < std::popcount(here); ++n) {
      std::uint8_t* const moved = block + kHead + 2 * n;
      store(moved, std::uint16_t(load16(moved) + by));
    }
  };
  const auto open_in_record = [&](std::size_t gap, std::size_t bytes) {
    open_gap(block, gap, bytes);
    move_begins(before + 1, bytes);
  };
  const auto end_of_record = [&] { return before + 1 < std::popcount(here) ? load16(block + begin + 2) : end_of(block); };
  if ((here >> at & 1) == 0) {
    const std::size_t record = before < std::popcount(here) ? load16(block + begin) : end_of(block);
    open_gap(block, begin, 2);
    here |= std::uint32_t(1) << at;
    store(block, here);
    store(block + begin, std::uint16_t(record));
    move_begins(0, 2);
    open_in_record(record + 2, 8);
    store(block + record + 2, std::uint64_t(0));
  }
  const std::size_t record = load16(block + begin);
  auto supercubes = load<std::uint64_t>(block + record);
  const int place = int(key % 64), n = count_below(supercubes, place);
  const std::size_t number = record + 8 + 2 * std::size_t(n);
  const bool is_here = (supercubes >> place & 1) != 0;
  if (!is_here) {
    open_in_record(number, 2);
    supercubes |= std::uint64_t(1) << place;
    store(block + record, supercubes);
  }
  const Number had = is_here ? load16(block + number) : kOwn;
  if (is_here && had >= kOwn) return store(block + record + Record{block + record}.own_word(had), word);
  const std::size_t end = end_of_record(), first = record + 8 + 2 * std::size_t(std::popcount(supercubes));
  open_in_record(end, 8);
  store(block + number, Number(kOwn + (end - first) / 8));
  store(block + end, word);
  if (had < kOwn) words.release(had);
  ++own_words_;
}

void SplitSet::settle(std::size_t most) {
  if (own_words_ < most || changed_.empty()) return;
  std::array<std::uint8_t, kPage * kMostOfRecord> records;
  std::array<std::uint16_t, kPage> begins;
  for (const std::uint32_t page : changed_) {
    Block& block = pages_[page];
    std::uint32_t here = 0;
    std::size_t count = 0, bytes = 0;
    const std::uint8_t* from = block.get() + kHead;
    for (const int brick : set_bits(load<std::uint32_t>(block.get()))) {
      const Record record{block.get() + load16(from)};
      from += 2;
      std::array<Number, 64> numbers;
      std::array<std::uint64_t, 64> own;
      std::size_t n = 0, owns = 0;
      int k = 0;
      std::uint64_t supercubes = 0;
      for (const int place : set_bits(record.supercubes())) {
        Number number = record.number(k++);
        if (number >= kOwn) {
          const auto word = load<std::uint64_t>(record.at + record.own_word(number));
          if (word == 0) continue;
          const auto found = words.use(word);
          number = found ? *found : Number(kOwn + owns);
          if (!found) own[owns++] = word;
        }
        numbers[n++] = number;
        supercubes |= std::uint64_t(1) << place;
      }
      if (supercubes == 0) continue;
      here |= std::uint32_t(1) << brick;
      begins[count++] = std::uint16_t(bytes);
      store(records.data() + bytes, supercubes);
      std::memcpy(records.data() + bytes + 8, numbers.data(), 2 * n);
      std::memcpy(records.data() + bytes + 8 + 2 * n, own.data(), 8 * owns);
      bytes += 8 + 2 * n + 8 * owns;
    }
    const std::size_t first = kHead + 2 * count, end = first + bytes;
    std::uint8_t* const to = block.get();  // what was there is no shorter
    store(to, here);
    store(to + kEnd, std::uint16_t(end));
    for (std::size_t i = 0; i < count; ++i) store(to + kHead + 2 * i, std::uint16_t(first + begins[i]));
    std::memcpy(to + first, records.data(), bytes);
    const std::size_t had = bytes_of(to), needs = units_of(end) * kUnit;
    if (count != 0 && needs == had) continue;
    std::uint8_t* const smaller = count == 0 ? nullptr : as_block(new (std::nothrow) std::uint8_t[needs - kAllocator], needs / kUnit);
    if (count != 0 && smaller == nullptr) continue;  // no memory: it stays as large as it is
    if (smaller != nullptr) move_to(smaller, to);
    delete[] block.release();
    block.reset(smaller);
    block_bytes_ -= had - (count == 0 ? 0 : needs);
  }
  changed_ = std::vector<std::uint32_t>();
  own_words_ = 0;
}

std::uint64_t SplitSet::bricks(std::size_t begin) const {
  const auto page = [this](std::size_t i) -> std::uint64_t { return i < pages_.size() && pages_[i] ? load<std::uint32_t>(pages_[i].get()) : 0; };
  return page(begin / kPage) | page(begin / kPage + 1) << kPage;
}

unsigned SplitSet::count(BrickIndex brick) const {
  const Record record = find(brick);
  if (record.at == nullptr) return 0;
  unsigned sum = 0;
  for (int n = 0; n < std::popcount(record.supercubes()); ++n) sum += unsigned(std::popcount(record.word(n)));
  return sum;
}

std::uint64_t SplitSet::count() const {
  std::uint64_t sum = 0;
  for (const Block& block : pages_) {
    for_each_in(block.get(), [&sum](unsigned, int, const Record& record, int n) { sum += std::uint64_t(std::popcount(record.word(n))); });
  }
  return sum;
}

std::vector<SlotGroup> SplitSet::groups(const SupercubeSet& set) const {
  std::vector<SlotGroup> groups;
  for (std::size_t page = 0; page < pages_.size(); ++page) {
    for_each_in(pages_[page].get(), [&](unsigned in_page, int place, const Record& record, int n) {
      const BrickIndex b(page * kPage + in_page);
      const SupercubeSet::Brick& brick = set.bricks()[b];
      const std::uint64_t word = record.word(n);
      if (word != 0) groups.push_back({b, brick.first_supercube + count_below(brick.mask, place), brick.key + unsigned(place), word});
    });
  }
  return groups;
}

bool operator==(const SplitSet& a, const SplitSet& b) {
  if (a.pages_.size() != b.pages_.size()) return false;
  for (std::size_t page = 0; page < a.pages_.size(); ++page) {
    std::array<std::uint64_t, SplitSet::kPage * 64> differs{};
    for (const SplitSet* const one : {&a, &b}) {
      SplitSet::for_each_in(one->pages_[page].get(), [&differs](unsigned brick, int place, const SplitSet::Record& record, int n) {
        differs[brick * 64 + unsigned(place)] ^= record.word(n);
      });
    }
    if (std::any_of(differs.begin(), differs.end(), [](std::uint64_t bits) { return bits != 0; })) return false;
  }
  return true;
}

}  // namespace intervale
