#include "server/volume/header_bytes.h"

#include <span>

namespace intervale {

Result<std::string> read_start(const InputFile& file, std::size_t most) {
  std::string bytes(std::min<std::uint64_t>(file.size(), most), '\0');
  const auto got = file.read_some(0, std::as_writable_bytes(std::span(bytes)));
  if (!got) return tl::unexpected<Error>(got.error());
  bytes.resize(*got);
  return bytes;
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const auto begin = text.find_first_not_of(kBlank);
  return begin == text.npos ? std::string_view{} : text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

}  // namespace intervale
