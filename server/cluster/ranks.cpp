#include "server/cluster/ranks.h"

namespace intervale {

Result<void> agree(Ranks& ranks, const Result<void>& result) {
  std::string text;
  if (!result) text = (result.error().usage ? 'u' : 'f') + result.error().message;
  for (const std::vector<std::byte>& bytes : ranks.gather(std::as_bytes(std::span(text)))) {
    if (bytes.empty()) continue;
    std::string message(reinterpret_cast<const char*>(bytes.data()) + 1, bytes.size() - 1);
    return char(bytes[0]) == 'u' ? misuse(std::move(message)) : fail(std::move(message));
  }
  return {};
}

}  // namespace intervale
