#include <new>

#include "common/mesh/mesh.h"

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace intervale {
namespace {

constexpr std::align_val_t kHugePage{std::size_t(2) << 20};

}  // namespace

void* allocate_large(std::size_t bytes) {
  void* const memory = ::operator new(bytes, kHugePage);
#if defined(__linux__)
  (void)madvise(memory, bytes, MADV_HUGEPAGE);  // only speed depends on it
#endif
  return memory;
}

void free_large(void* memory) { ::operator delete(memory, kHugePage); }

}  // namespace intervale
