// Words of 64 bits by numbers of 16, for what holds many of few different ones.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>

namespace intervale {

// A word has a number as long as it is used, and each use is counted. Any thread; those that use words that others use,
// too, do not wait for each other. Memory: 1 MB once as many different words are used as there are numbers.
class InternedWords {
 public:
  using Number = std::uint16_t;
  static constexpr std::size_t kMost = 16 * 4032;  // different words
  static constexpr Number kLimit = 0xffc0;         // numbers are below

  // Uses a word: its number. nullopt: it has none, and there is none left.
  [[nodiscard]] std::optional<Number> use(std::uint64_t word);
  // Uses a word once more, or once less; number: of one that is used. With 2^32 uses at a time it keeps its number.
  void use_again(Number number);
  void release(Number number);
  // number: of a word that is used.
  [[nodiscard]] std::uint64_t operator[](Number number) const { return words_[number].load(std::memory_order_relaxed); }

 private:
  using Uses = std::uint32_t;
  static constexpr Uses kForever = 0xffffffff;
  static constexpr std::size_t kShards = 16, kNumbers = 4096, kPlaces = 2 * kNumbers;  // the last two of a shard
  // The words of some hashes, with numbers of their own. It is searched without the lock first: that may miss a word,
  // or find one whose number is just given to another.
  struct Shard {
    std::array<std::atomic<std::uint16_t>, kPlaces> places{};  // open addressing: number in the shard + 1, or 0
    std::mutex changing;
    std::atomic<std::uint16_t> free = 0;     // a number + 1 that had a word before, or 0; its word is the next such one
    std::atomic<std::uint16_t> numbers = 0;  // that had words at any time
    [[nodiscard]] bool is_full() const {
      return free.load(std::memory_order_relaxed) == 0 && numbers.load(std::memory_order_relaxed) == kMost / kShards;
    }
  };
  struct Hash {
    std::size_t shard, place;
  };
  [[nodiscard]] static Hash hash_of(std::uint64_t word);
  [[nodiscard]] static Number number_of(std::size_t shard, unsigned in_shard) { return Number(shard * kNumbers + in_shard - 1); }
  // Where a shard has a word; or else the empty place where it would be.
  [[nodiscard]] std::size_t find(const Hash& hash, std::uint64_t word) const;
  bool use_if_used(Number number);
  void remove(Number number);

  std::array<std::atomic<std::uint64_t>, kShards * kNumbers> words_{};  // by number
  std::array<std::atomic<Uses>, kShards * kNumbers> uses_{};
  std::array<Shard, kShards> shards_{};
};

}  // namespace intervale
