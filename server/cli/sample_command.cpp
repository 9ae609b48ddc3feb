#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <csignal>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/program/progress.h"
#include "server/cli/commands.h"
#include "server/volume/nrrd.h"
#include "server/volume/raw_reader.h"
#include "server/volume/sample_field.h"
#include "server/volume/samples.h"

namespace intervale {
namespace {

constexpr std::size_t kSlabBytes = 8 << 20;

struct SampleCommand {
  std::string name;
  std::string output;
  int size = 129;
  std::string type = "f32";
  bool json = false;
};

volatile std::sig_atomic_t stop_signal = 0;

// A second signal ends the program at once.
void note_signal(int number) {
  stop_signal = number;
  std::signal(number, SIG_DFL);
}

// A file that takes long may be many gigabytes: a signal shall not leave a part of it behind.
void note_signals() {
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    if (std::signal(number, note_signal) == SIG_IGN) std::signal(number, SIG_IGN);
  }
}

// Slab by slab: no more than one is in memory. Fails if there was a signal.
Result<void> write_field(const std::string& path, const SampleField& field) {
  auto file = NrrdWriter::create(path, field.header());
  if (!file) return tl::unexpected(file.error());
  Progress progress("making " + field.header().name);
  const std::uint64_t rows = field.rows(), rows_a_slab = std::max<std::uint64_t>(1, kSlabBytes / field.row_bytes());
  std::vector<std::byte> slab(std::min(rows, rows_a_slab) * field.row_bytes());
  for (std::uint64_t first = 0; first < rows; first += rows_a_slab) {
    slab.resize(std::min(rows - first, rows_a_slab) * field.row_bytes());
    field.fill(first, slab);
    if (auto written = file->write(slab); !written) return written;
    if (stop_signal != 0) return fail("stopped by a signal");
    progress.fraction(double(first) / double(rows));
  }
  return file->commit();
}

Result<void> run(const SampleCommand& options) {
  const auto type = parse_sample_type(options.type);
  if (!type) return tl::unexpected(type.error());
  const auto field = SampleField::create(options.name, options.size, *type);
  if (!field) return tl::unexpected(field.error());
  note_signals();
  auto written = write_field(options.output, *field);
  if (stop_signal != 0) std::raise(stop_signal);
  if (!written) return written;
  const std::uint64_t bytes = field->rows() * field->row_bytes();
  if (options.json)
    return print_json(
        {{"name", options.name}, {"dims", field->header().grid.dims}, {"type", options.type}, {"file", options.output}, {"bytes", bytes}});
  return print(fmt::format("wrote {}: {} at {} samples a side, {}\n", options.output, options.name, options.size, human_bytes(bytes)));
}

}  // namespace

void add_sample_command(Program& program) {
  const auto options = std::make_shared<SampleCommand>();
  CLI::App& command = program.add_command("sample", "Write a synthetic volume, for tests and demonstrations", [options] { return run(*options); });
  command.add_option("NAME", options->name, fmt::format("{}", fmt::join(sample_names(), ", ")))->required();
  command.add_option("-o,--output", options->output, "Volume to write (.nrrd)")->required()->type_name("FILE");
  command.add_option("--size", options->size, fmt::format("Number of samples along each axis, {} to {}", kMinSampleSize, kMaxFieldSize))
      ->capture_default_str();
  command
      .add_option("--type", options->type,
                  "Type of a sample: u8, i8, u16, i16, u32, i32, f32 or f64. Of whole numbers, the nominal range of the values (gyroid: -1.5 to 1.5; "
                  "the others: 0 to 255) becomes the range of the type, rounded; so u8 has 0 to 255 as they are")
      ->capture_default_str()
      ->type_name("TYPE");
  add_json_flag(command, options->json);
}

}  // namespace intervale
