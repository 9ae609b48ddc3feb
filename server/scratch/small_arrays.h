// Small arrays, many in a chunk of memory: which places are free, and where the next array goes.
//
// Lists alone: nothing is written to the chunks, so that their pages come into memory only where arrays are used.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

namespace intervale {

// One thread at a time.
class SmallArrays {
 public:
  static constexpr std::size_t kLeastBytes = 128;       // of an array that is worth a place
  static constexpr std::size_t kMostBytes = 16 << 10;   // of one that has a place
  static constexpr std::size_t kChunkBytes = 64 << 10;  // of one size each: places are up to a quarter larger than arrays

  static constexpr std::size_t kSizeClasses = 29;

  // A place for an array of up to kMostBytes, at a multiple of 32 bytes from its chunk's beginning; nullptr: there is none,
  // add() a chunk for arrays of so many bytes.
  [[nodiscard]] std::byte* take(std::size_t bytes);
  // chunk: kChunkBytes, until free() returns it.
  void add(std::size_t bytes, std::byte* chunk);

  struct Freed {
    bool is_known = false;              // the array was one of these
    std::byte* unused_chunk = nullptr;  // which is no longer among these
  };
  Freed free(std::byte* array);

 private:
  struct Chunk {
    std::size_t size_class = 0, used = 0;
    std::size_t place = 0;                 // in with_room_, if it has room
    std::vector<std::uint64_t> free = {};  // by place of an array: a bit
  };
  using Chunks = std::map<std::byte*, Chunk>;

  Chunks chunks_;                                                      // by their beginnings
  std::array<std::vector<Chunks::iterator>, kSizeClasses> with_room_;  // by size class
};

}  // namespace intervale
