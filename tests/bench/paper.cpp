#include "tests/bench/paper.h"

#include <algorithm>
#include <cctype>

namespace intervale::bench {
namespace {

bool begins_with(const std::string& name, std::string_view small) {
  return name.size() >= small.size() &&
         std::equal(small.begin(), small.end(), name.begin(), [](char a, char b) { return a == char(std::tolower(static_cast<unsigned char>(b))); });
}

}  // namespace

const PaperSizes* paper_sizes(const Case& c) {
  const auto longest = *std::max_element(c.volume->grid.dims.begin(), c.volume->grid.dims.end());
  const auto found = std::find_if(kPaperTable1.begin(), kPaperTable1.end(), [&](const PaperSizes& p) {
    return begins_with(c.name, p.name) && c.range == p.range && c.refine == p.refine && 2 * longest >= p.longest;
  });
  return found == kPaperTable1.end() ? nullptr : &*found;
}

const PaperTimes* paper_times(const Case& c) {
  if (paper_sizes(c) == nullptr) return nullptr;
  const auto found = std::find_if(kPaperTable2.begin(), kPaperTable2.end(), [&](const PaperTimes& p) { return begins_with(c.name, p.name); });
  return found == kPaperTable2.end() ? nullptr : &*found;
}

}  // namespace intervale::bench
