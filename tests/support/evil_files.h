// Files with right checksums whose contents lie, of both kinds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace intervale::testing {

struct EvilFile {
  std::string name;
  std::vector<std::byte> bytes;
  std::string about;  // that the refusal contains
};

// Of one range and of every range, both with channels; in order.
[[nodiscard]] std::vector<std::byte> good_file_of_one_range();
[[nodiscard]] std::vector<std::byte> good_file_of_every_range();

// Those files, each with one lie. Names are distinct, and names of files.
[[nodiscard]] std::vector<EvilFile> evil_files();

}  // namespace intervale::testing
