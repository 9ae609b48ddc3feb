// An indexed tetrahedral mesh of an interval volume.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "common/util/export.h"

namespace intervale {

// What a mesh point lies on: a grid vertex inside the range (inside), the alpha surface or the beta surface.
enum class Surface : std::uint8_t { inside = 0, alpha = 1, beta = 2 };

// Memory for an array of many MiB, in huge pages where the system has them: to touch ordinary ones for the first time
// would take a fifth of the time of making a mesh. Throws std::bad_alloc.
[[nodiscard]] INTERVALE_EXPORT void* allocate_large(std::size_t bytes);
INTERVALE_EXPORT void free_large(void* memory);

// An allocator whose vectors leave new elements uninitialised: a large mesh is written once, by many threads.
template <class T>
struct DefaultInit : std::allocator<T> {
  template <class U>
  struct rebind {
    using other = DefaultInit<U>;
  };
  [[nodiscard]] T* allocate(std::size_t n) {
    return n < kLarge / sizeof(T) ? std::allocator<T>::allocate(n) : static_cast<T*>(allocate_large(n * sizeof(T)));
  }
  void deallocate(T* p, std::size_t n) { return n < kLarge / sizeof(T) ? std::allocator<T>::deallocate(p, n) : free_large(p); }
  template <class U>
  void construct(U* p) {
    ::new (static_cast<void*>(p)) U;
  }
  template <class U, class... Args>
  void construct(U* p, Args&&... args) {
    ::new (static_cast<void*>(p)) U(std::forward<Args>(args)...);
  }

 private:
  static constexpr std::size_t kLarge = std::size_t(4) << 20;  // bytes
};
template <class T>
using MeshArray = std::vector<T, DefaultInit<T>>;

// A channel (channel.h) at the points of a mesh; NaN where it is not known.
struct PointArray {
  std::string name, unit;   // unit: empty if it is not known
  unsigned components = 1;  // 1, or 3 of a vector
  MeshArray<double> value;  // `components` for each point, side by side
};

// Points in world coordinates, each used by a tetrahedron and given once (once for each range that it is of);
// tetrahedra as four point indices, positively oriented: (p1 - p0) x (p2 - p0) . (p3 - p0) > 0 (zero only where alpha =
// beta).
struct Mesh {
  MeshArray<std::array<double, 3>> points;
  MeshArray<Surface> surface;  // one for each point
  MeshArray<double> value;     // of the field, one for each point; or none, where it is not known
  MeshArray<std::array<std::uint32_t, 4>> tets;
  // Of a mesh of several ranges, which of them each tetrahedron is of: 0, 1, ... (join.h); none for one range.
  MeshArray<std::uint8_t> part = {};
  std::vector<PointArray> channels = {};  // those that were asked for
};

// The sum of the volumes of the tetrahedra, in world units cubed; compensated, so that their order changes it by less
// than 1e-12 relative.
[[nodiscard]] INTERVALE_EXPORT double volume_of(const Mesh& mesh);

}  // namespace intervale
