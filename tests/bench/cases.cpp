#include "tests/bench/cases.h"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <exception>
#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "server/builder/value_steps.h"
#include "server/volume/read_volume.h"
#include "server/volume/samples.h"
#include "tests/support/split.h"

namespace intervale::bench {
namespace {

// The paper's range for the buckyball; for the others one that meets a good part of the volume.
const std::map<std::string_view, Range> kSampleRanges{
    {"buckyball", {128, 188}}, {"gyroid", {-0.5, 0.5}}, {"marschner-lobb", {100, 140}}, {"hydrogen", {20, 120}}};

std::optional<double> number(const std::string& text) {
  try {
    std::size_t used = 0;
    const double value = std::stod(text, &used);
    if (used == text.size() && !std::isnan(value)) return value;
  } catch (const std::exception&) {
    // no number
  }
  return {};
}

template <class T>
bool read_three(const std::string& text, std::array<T, 3>& out) {
  const auto parts = testing::split(text, 'x');
  for (std::size_t i = 0; i < 3; ++i) {
    const auto value = parts.size() == 3 ? number(parts[i]) : std::nullopt;
    if (!value) return false;
    out[i] = T(*value);
  }
  return true;
}

// Rounds the samples as `intervale build` does, if that has to be.
Result<Case> case_of(Volume volume) {
  if (auto finite = check_finite(volume, {}); !finite) return tl::unexpected(finite.error());
  const auto format = choose_value_format(volume, {});
  if (!format) return tl::unexpected(format.error());
  round_samples(volume, *format);
  Case c;
  c.name = volume.name;
  c.volume = std::make_shared<const Volume>(std::move(volume));
  c.format = *format;
  return c;
}

}  // namespace

Result<Case> read_case(std::string_view text) {
  const auto wrong = [&](const std::string& what) { return misuse("'" + std::string(text) + "': " + what + "; give " + kCaseSyntax); };
  const auto parts = testing::split(text, ',');
  const auto low = parts.size() < 3 ? std::nullopt : number(parts[1]), high = parts.size() < 3 ? std::nullopt : number(parts[2]);
  if (!low || !high || *low > *high) return wrong("no range");
  std::string name;
  Refine refine = Refine::boundary;
  RawLayout layout;
  Vec3 spacing{1, 1, 1};
  std::string source = parts[0];  // what the volume depends on
  bool raw = false;
  for (std::size_t i = 3; i < parts.size(); ++i) {
    const std::string& part = parts[i];
    const auto value = part.substr(std::min(part.size(), part.find('=') + 1));
    if (part.starts_with("name=")) {
      name = value;
      continue;
    }
    if (part == "refine=uniform" || part == "refine=boundary") {
      refine = value == "uniform" ? Refine::uniform : Refine::boundary;
      continue;
    }
    raw = true;
    source += "," + part;
    if (part == "big-endian") {
      layout.big_endian = true;
    } else if (part.starts_with("type=")) {
      const auto type = parse_sample_type(value);
      if (!type) return tl::unexpected(type.error());
      layout.type = *type;
    } else if (!(part.starts_with("dims=") && read_three(value, layout.dims)) && !(part.starts_with("spacing=") && read_three(value, spacing))) {
      return wrong("'" + part + "' is none of what may follow");
    }
  }
  layout.affine = Affine::of(spacing);
  static std::string last_source;
  static Case last;
  if (source != last_source) {
    auto volume = read_volume(parts[0], raw ? std::optional(layout) : std::nullopt);
    if (!volume) return tl::unexpected(volume.error());
    auto read = case_of(std::move(*volume));
    if (!read) return read;
    last = std::move(*read);
    last_source = source;
  }
  Case c = last;
  c.range = {*low, *high};
  c.refine = refine;
  if (!name.empty()) c.name = name;
  return c;
}

Result<Case> sample_case(std::string_view name, int size) {
  auto made = make_sample(name, size);
  if (!made) return tl::unexpected(made.error());
  auto c = case_of(std::move(*made));
  if (!c) return c;
  const auto range = kSampleRanges.find(name);
  c->range = range == kSampleRanges.end() ? Range{0, 1} : range->second;
  return c;
}

void for_each_case(int argc, char** argv, const std::function<void(const Case&)>& measure) {
  if (argc < 2) {
    for (const char* name : {"gyroid", "buckyball"}) measure(or_throw(sample_case(name, 97)));
  }
  for (int i = 1; i < argc; ++i) measure(or_throw(read_case(argv[i])));
}

BoxFrame frame_of(const Grid& grid) {
  const Vec3 spacing = grid.affine.spacing();
  BoxFrame frame{.middle = grid.affine.origin()};
  Vec3 side{};
  for (std::size_t i = 0; i < 3; ++i) {
    side[i] = spacing[i] * (grid.dims[i] - 1);
    frame.middle[i] += side[i] / 2;
  }
  frame.diagonal = length(side);
  return frame;
}

int run_or_report(const char* program, int (*run)(int argc, char** argv), int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", program, error.what());
    return 1;
  }
}

std::string range_text(const Range& range, Refine refine) {
  return fmt::format("[{}, {}]{}", range.alpha, range.beta, refine == Refine::uniform ? ", uniform" : "");
}

}  // namespace intervale::bench
