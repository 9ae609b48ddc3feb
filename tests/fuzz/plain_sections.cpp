// Stands before libxxhash and libzstd in the programs that fuzz the file format: every checksum is 0 and every
// compressed section is its own contents. No mutation passes a real checksum, and few a real zstd frame; with these the
// fuzzer reaches what the reader does with contents that cannot be trusted.
#include <xxhash.h>
#include <zstd.h>

#include <cstring>

extern "C" {

XXH64_hash_t XXH3_64bits(const void*, std::size_t) { return 0; }
XXH64_hash_t XXH3_64bits_withSeed(const void*, std::size_t, XXH64_hash_t) { return 0; }

std::size_t ZSTD_compress(void* to, std::size_t capacity, const void* from, std::size_t size, int) {
  if (size > capacity) return std::size_t(-1);  // an error code of zstd's
  if (size > 0) std::memcpy(to, from, size);
  return size;
}

std::size_t ZSTD_compressCCtx(ZSTD_CCtx*, void* to, std::size_t capacity, const void* from, std::size_t size, int) {
  return ZSTD_compress(to, capacity, from, size, 0);
}

std::size_t ZSTD_decompress(void* to, std::size_t capacity, const void* from, std::size_t size) { return ZSTD_compress(to, capacity, from, size, 0); }
}
