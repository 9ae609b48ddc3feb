// Inside the mesh writers: numbers and text into a ByteSink, with one check at the end.
#pragma once

#include <array>
#include <bit>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "common/mesh/boundary.h"
#include "common/mesh/io/mesh_writer.h"
#include "common/mesh/mesh.h"
#include "common/util/decimal.h"
#include "common/util/vec3.h"

namespace intervale {

static_assert(std::endian::native == std::endian::little, "every binary mesh format here is little endian and written as the machine holds it");

// What the writer of a format writes to. The first error is kept and everything after it ignored, so that the writer
// need not look.
class MeshOutput {
 public:
  // path: for errors. Both outlive the MeshOutput.
  MeshOutput(const std::filesystem::path& path, const ByteSink& sink) : path_(path), sink_(sink) {}

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

  // why: what of the mesh does not fit the format.
  void fail(const std::string& why) {
    if (result_) result_ = intervale::fail("cannot write '" + path_.string() + "': " + why);
  }

  [[nodiscard]] Result<void> result() const { return result_; }

 private:
  void append(std::span<const std::byte> bytes) {
    if (result_ && !bytes.empty()) result_ = sink_(bytes);
  }
  const std::filesystem::path& path_;
  const ByteSink& sink_;
  Result<void> result_;
};

[[nodiscard]] inline std::array<float, 3> narrowed(const Vec3& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

// One function a format. The coordinates are finite as the format holds them.
void write_vtu(MeshOutput& out, const Mesh& mesh);
void write_vtp(MeshOutput& out, const Mesh& mesh, const BoundaryMesh& boundary);
void write_ply(MeshOutput& out, const Mesh& mesh, const BoundaryMesh& boundary);
void write_stl(MeshOutput& out, const Mesh& mesh, const BoundaryMesh& boundary);
void write_obj(MeshOutput& out, const Mesh& mesh, const BoundaryMesh& boundary);
void write_glb(MeshOutput& out, const Mesh& mesh, const BoundaryMesh& boundary);

}  // namespace intervale
