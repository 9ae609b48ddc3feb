// The program's `operator new`: arrays lie in a scratch file while one is installed: large ones of a build
// (build --memory), and those of data sets that are served (serve --data-memory).
//
// Whoever allocates them: so no array, of today or of later, exceeds the budget by being forgotten. [new.delete]
// of the C++ standard lets a program replace these. Those for extended alignment are left as they are.
#include <cstddef>
#include <cstdlib>
#include <new>

#include "server/scratch/scratch_memory.h"

void* operator new(std::size_t bytes) {
  using intervale::ScratchMemory;
  if (bytes >= intervale::SmallArrays::kLeastBytes) {
    if (ScratchMemory* const scratch = ScratchMemory::place_of(bytes)) return scratch->allocate(bytes);
  }
  if (bytes == 0) bytes = 1;
  for (;;) {
    if (void* const memory = std::malloc(bytes)) return memory;
    const std::new_handler handler = std::get_new_handler();
    if (handler == nullptr) throw std::bad_alloc();
    handler();
  }
}

void operator delete(void* memory) noexcept {
  if (!intervale::ScratchMemory::free_installed(memory)) std::free(memory);
}

// The others, as the standard library has them. A sanitizer has its own, which would allocate what the above frees.
void* operator new(std::size_t bytes, const std::nothrow_t& /*unused*/) noexcept {
  try {
    return operator new(bytes);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}
void* operator new[](std::size_t bytes) { return operator new(bytes); }
void* operator new[](std::size_t bytes, const std::nothrow_t& nothrow) noexcept { return operator new(bytes, nothrow); }
void operator delete(void* memory, std::size_t /*bytes*/) noexcept { operator delete(memory); }
void operator delete(void* memory, const std::nothrow_t& /*unused*/) noexcept { operator delete(memory); }
void operator delete[](void* memory) noexcept { operator delete(memory); }
void operator delete[](void* memory, std::size_t /*bytes*/) noexcept { operator delete(memory); }
void operator delete[](void* memory, const std::nothrow_t& /*unused*/) noexcept { operator delete(memory); }
