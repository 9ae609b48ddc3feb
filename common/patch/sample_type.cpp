#include "common/patch/sample_type.h"

#include <array>

namespace intervale {
namespace {

struct Type {
  const char* name;
  std::size_t bytes;
};
// In SampleType's order.
constexpr std::array<Type, 8> kTypes{{{"u8", 1}, {"i8", 1}, {"u16", 2}, {"i16", 2}, {"u32", 4}, {"i32", 4}, {"f32", 4}, {"f64", 8}}};

}  // namespace

std::size_t size_of(SampleType type) { return kTypes[std::size_t(type)].bytes; }
const char* name_of(SampleType type) { return kTypes[std::size_t(type)].name; }

}  // namespace intervale
