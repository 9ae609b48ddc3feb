// Bytes as a file of every range, without the shield of checksums (plain_sections.cpp).
#include <cstdlib>

#include "common/ivm/every_range.h"
#include "common/ivm/extraction.h"
#include "common/ivm/value_file.h"
#include "common/ivm/value_verify.h"
#include "common/ranges/find_relevant_updates.h"
#include "tests/fuzz/small_volumes.h"

namespace {

// Files made by this very program must be read: else the stand-in for the checksum no longer fits the format, and
// nothing is tested.
bool reads_its_own() {
  for (const auto& v : intervale::testing::small_value_volumes()) {
    if (!intervale::decode_values(intervale::encode_values(v), "seed")) std::abort();
  }
  return true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const bool ready = reads_its_own();
  const auto decoded = intervale::decode_values(std::as_bytes(std::span(data, ready ? size : 0)), "fuzzed");
  if (!decoded) {
    if (decoded.error().message.empty()) std::abort();
    return 0;
  }
  (void)validate(*decoded);
  const intervale::ValueFormat& format = decoded->description().format;
  const double middle = format.value(format.last / 2);
  const auto volume = intervale::of_every_range(intervale::ValueVolume::Parts(decoded->parts()));
  if (!volume) std::abort();
  const intervale::ShownRange shown{{middle, middle}, {}};
  const auto relevant = intervale::PartFinder(*volume).find({shown});
  if (const auto mesh = extract(*volume, *relevant, {}); !mesh || mesh->front.validate()) std::abort();
  if (!intervale::decode_values(intervale::encode_values(*decoded), "again")) std::abort();
  return 0;
}
