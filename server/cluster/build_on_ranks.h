// Builds a data set of every range by several ranks, each of which has some of the samples.
//
// Each rank reads the samples of its boxes, one field after the other: first that of the data set, then the channels.
// Every byte is that of a build by one program (value_builder.h): what ranks add up are whole numbers, largest errors and
// bits, which do not depend on the order, and pages are coded by themselves.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/ivm/kept_pages.h"
#include "common/ivm/value_volume.h"
#include "common/util/result.h"
#include "server/builder/kept_errors.h"
#include "server/cluster/rank_samples.h"
#include "server/cluster/ranks.h"

namespace intervale {

// Another field on the grid of the data set.
struct RankChannel {
  std::string name;
  RankInput input;
  std::optional<double> step;
};

struct RankBuild {
  FieldDescription field;  // name, grid and labels are known
  RankInput input;         // of that grid, with one number a sample
  std::optional<double> step;
  std::vector<RankChannel> channels;
  std::filesystem::path output;                                   // the same file for all ranks
  std::function<void(double)> progress;                           // as of BuildOptions, of the field
  std::function<void(const std::string&)> begins = {};            // called before a channel is read, with its name
  std::function<void(const std::filesystem::path&)> writes = {};  // called with the temporary file before it is written, and with nothing after it
  KeptErrors* errors = nullptr;                                   // of this rank; as of BuildOptions
  KeptPages* pages = nullptr;                                     // likewise
};

struct BuiltByRanks {
  FieldDescription field;
  std::uint64_t updates = 0, supercubes = 0, file_bytes = 0;
};

// Writes the file, and returns the same to all ranks. Fails on all ranks if it does on one. Memory of a rank: its samples and
// keys; and for each eighth sample of the volume a key and five bytes. Misuse for more than kMostSamples samples.
[[nodiscard]] Result<BuiltByRanks> build_on_ranks(Ranks& ranks, const RankBuild& build);

}  // namespace intervale
