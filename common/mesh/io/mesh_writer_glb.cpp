// glTF 2.0, binary container (Khronos Group, glTF 2.0 Specification, section 4): one buffer, float32 positions, then
// uint32 indices.
#include <algorithm>
#include <limits>
#include <string>

#include "common/mesh/io/mesh_output.h"

namespace intervale {
namespace {

constexpr std::uint32_t kMagic = 0x46546C67, kVersion = 2, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
constexpr int kFloat = 5126, kUnsignedInt = 5125, kArrayBuffer = 34962, kElementArrayBuffer = 34963;
constexpr std::uint64_t kHeadBytes = 12, kChunkHeadBytes = 8;

using Position = std::array<float, 3>;

// A float's exact value: validators compare the bounds with the positions bit by bit.
std::string json(const Position& v) {
  std::string text = "[";
  for (const float coordinate : v) {
    std::array<char, 32> digits;
    text.append(text.size() > 1 ? "," : "").append(decimal(static_cast<double>(coordinate), digits));
  }
  return text + "]";
}

std::string document(std::uint64_t points, std::uint64_t triangles, const Position& low, const Position& high) {
  const auto number = [](std::uint64_t n) { return std::to_string(n); };
  const std::string head = R"({"asset":{"version":"2.0","generator":"Intervale )" INTERVALE_VERSION R"("},"scene":0,"scenes":[{)";
  if (triangles == 0) return head + R"("nodes":[0]}],"nodes":[{"name":"empty"}]})";  // glTF forbids empty accessors, meshes and buffers
  const auto position_bytes = points * sizeof(Position), index_bytes = triangles * 12;
  return head + R"("nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"mode":4}]}],)" +
         R"("accessors":[{"bufferView":0,"componentType":)" + number(kFloat) + R"(,"count":)" + number(points) + R"(,"type":"VEC3","min":)" +
         json(low) + R"(,"max":)" + json(high) + R"(},{"bufferView":1,"componentType":)" + number(kUnsignedInt) + R"(,"count":)" +
         number(3 * triangles) + R"(,"type":"SCALAR"}],"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":)" + number(position_bytes) +
         R"(,"target":)" + number(kArrayBuffer) + R"(},{"buffer":0,"byteOffset":)" + number(position_bytes) + R"(,"byteLength":)" +
         number(index_bytes) + R"(,"target":)" + number(kElementArrayBuffer) + R"(}],"buffers":[{"byteLength":)" +
         number(position_bytes + index_bytes) + "}]}";
}

}  // namespace

void write_glb(MeshOutput& out, const Mesh& mesh, const BoundaryMesh& boundary) {
  Position low, high;
  low.fill(std::numeric_limits<float>::max());
  high.fill(std::numeric_limits<float>::lowest());
  for (const auto point : boundary.points) {
    const auto position = narrowed(mesh.points[point]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], position[axis]);
      high[axis] = std::max(high[axis], position[axis]);
    }
  }
  auto text = document(boundary.points.size(), boundary.triangles.size(), low, high);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::uint64_t binary_bytes = boundary.points.size() * sizeof(Position) + boundary.triangles.size() * 12;
  const std::uint64_t total = kHeadBytes + kChunkHeadBytes + text.size() + (binary_bytes > 0 ? kChunkHeadBytes + binary_bytes : 0);
  if (total > std::numeric_limits<std::uint32_t>::max())
    return out.fail("the surface takes " + std::to_string(total) + " bytes, and .glb ends at 4 GiB; write .vtp or .ply");

  out.number(kMagic);
  out.number(kVersion);
  out.number(static_cast<std::uint32_t>(total));
  out.number(static_cast<std::uint32_t>(text.size()));
  out.number(kJsonChunk);
  out.text(text);
  if (binary_bytes > 0) {
    out.number(static_cast<std::uint32_t>(binary_bytes));
    out.number(kBinaryChunk);
    for (const auto point : boundary.points) out.number(narrowed(mesh.points[point]));
    out.numbers(boundary.triangles);
  }
}

}  // namespace intervale
