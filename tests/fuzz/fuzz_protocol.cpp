// Bytes as a message, by the first byte: from a client or from a server. What decodes must survive another round.
#include <cstdlib>
#include <variant>

#include "protocol/codec.h"

using namespace intervale::protocol;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::span<const std::uint8_t> bytes(data + 1, size - 1);
  switch (data[0] % 2) {
    case 0:
      if (const auto message = decode_client_message(bytes)) {
        const auto again = decode_client_message(encode(*message));
        if (!again || again->index() != message->index()) std::abort();
      }
      break;
    default:
      if (const auto message = decode_server_message(bytes)) {
        const auto again = decode_server_message(encode(*message));
        if (!again || again->index() != message->index()) std::abort();
      }
  }
  return 0;
}
