// Inside the mesh writers: numbers and text into an AtomicFile, with one check at the end.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/mesh/boundary.h"
#include "common/mesh/mesh.h"
#include "common/util/atomic_file.h"
#include "common/util/decimal.h"

namespace intervale {

static_assert(std::endian::native == std::endian::little, "every binary mesh format here is little endian and written as the machine holds it");

// The first error is kept and everything after it ignored, until commit() hands it back: a writer of a format reads as the format does.
class MeshOutput {
 public:
  static Result<MeshOutput> create(const std::filesystem::path& path) {
    auto file = AtomicFile::create(path);
    if (!file) return tl::unexpected<Error>(file.error());
    return MeshOutput(std::move(*file));
  }

  // The bytes of a number or of an array of numbers. T has no padding.
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void number(const T& value) {
    static_assert(std::has_unique_object_representations_v<T> || std::is_floating_point_v<T> || !std::is_scalar_v<T>);
    append(std::as_bytes(std::span(&value, 1)));
  }

  template <class T, class Allocator>
  void numbers(const std::vector<T, Allocator>& values) {
    append(std::as_bytes(std::span(values)));
  }

  void text(std::string_view text) { append(std::as_bytes(std::span(text.data(), text.size()))); }

  // As of decimal.h.
  template <class T>
  void decimal(T value) {
    std::array<char, 32> digits;
    text(intervale::decimal(value, digits));
  }

  void fail(std::string message) {
    if (result_) result_ = intervale::fail(std::move(message));
  }

  Result<void> commit() { return result_ ? file_.commit() : result_; }

 private:
  explicit MeshOutput(AtomicFile file) : file_(std::move(file)) {}
  void append(std::span<const std::byte> bytes) {
    if (result_ && !bytes.empty()) result_ = file_.write(bytes);
  }
  AtomicFile file_;
  Result<void> result_;
};

// One function a format. Each makes, fills and commits the file.
Result<void> write_vtu(const std::filesystem::path& path, const Mesh& mesh);
Result<void> write_vtp(const std::filesystem::path& path, const Mesh& mesh, const BoundaryMesh& boundary);
Result<void> write_ply(const std::filesystem::path& path, const Mesh& mesh, const BoundaryMesh& boundary);
Result<void> write_stl(const std::filesystem::path& path, const Mesh& mesh, const BoundaryMesh& boundary);
Result<void> write_obj(const std::filesystem::path& path, const Mesh& mesh, const BoundaryMesh& boundary);
Result<void> write_glb(const std::filesystem::path& path, const Mesh& mesh, const BoundaryMesh& boundary);

}  // namespace intervale
