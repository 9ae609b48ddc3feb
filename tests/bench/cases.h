// What is measured: volumes, and a range of each.
#pragma once

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "common/diamond/grid.h"
#include "common/patch/description.h"
#include "common/patch/value_format.h"
#include "common/patch/volume.h"
#include "common/util/result.h"
#include "common/util/vec3.h"

namespace intervale::bench {

struct Case {
  std::string name;
  std::shared_ptr<const Volume> volume;  // as a data set represents it; shared by the cases that differ in nothing but range and refine
  ValueFormat format;                    // of its values: that of `intervale build` without --step
  Range range;
  Refine refine = Refine::boundary;
};

inline constexpr const char* kCaseSyntax =
    "PATH,LO,HI and then, as needed: dims=XxYxZ, type=u8, big-endian, spacing=XxYxZ (raw samples), refine=uniform, name=NAME";

// Reads a case from the text above; misuse if it is none. A volume that the last call read is not read again. One
// thread.
[[nodiscard]] Result<Case> read_case(std::string_view text);

// One of the product's own samples, with a range that suits it.
[[nodiscard]] Result<Case> sample_case(std::string_view name, int size);

// Calls measure() for each case of a command line, or without any for two of the product's own samples. Throws what is
// wrong with one.
void for_each_case(int argc, char** argv, const std::function<void(const Case&)>& measure);

// Where cameras look at, and how far away they are measured in: of an axis-parallel box.
struct BoxFrame {
  Vec3 middle{};
  double diagonal = 0;
};
[[nodiscard]] BoxFrame frame_of(const Grid& grid);

// What the measurements do about errors.
template <class T>
T or_throw(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

// What main() of a measurement does: run(argc, argv), or one line on stderr and status 1.
int run_or_report(const char* program, int (*run)(int argc, char** argv), int argc, char** argv);

// "[59.1, 124.1]", with ", uniform" after it where that is so.
[[nodiscard]] std::string range_text(const Range& range, Refine refine);

}  // namespace intervale::bench
