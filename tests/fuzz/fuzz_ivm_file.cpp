// Bytes as an interval volume file, without the shield of checksums and compression (plain_sections.cpp).
#include <cstdlib>

#include "common/ivm/ivm_file.h"
#include "common/ivm/verify.h"
#include "tests/fuzz/small_volumes.h"

namespace {

// Files made by this very program must be read: else the stand-ins for checksum and compression no longer fit the
// format, and nothing is tested.
bool reads_its_own() {
  for (const auto& v : intervale::testing::small_volumes()) {
    const auto decoded = intervale::decode_ivm(intervale::encode_ivm(v), "seed");
    if (!decoded || decoded->description().content_hash != 0) std::abort();
  }
  return true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const bool ready = reads_its_own();
  const auto decoded = intervale::decode_ivm(std::as_bytes(std::span(data, ready ? size : 0)), "fuzzed");
  if (!decoded) {
    if (decoded.error().message.empty()) std::abort();
    return 0;
  }
  (void)validate(*decoded);
  if (!intervale::decode_ivm(intervale::encode_ivm(*decoded), "again")) std::abort();
  return 0;
}
