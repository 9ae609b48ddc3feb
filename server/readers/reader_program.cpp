#include "server/readers/reader_program.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <new>
#include <string_view>

#include "server/volume/header_bytes.h"
#include "server/volume/header_line.h"

namespace intervale {
namespace {

constexpr std::size_t kMostFiles = 1 << 20;
constexpr rlim_t kMostMemory = rlim_t(8) << 30;  // bytes

// A library may take all memory for what a file claims. Sanitizers need more addresses than there is memory.
void limit_memory() {
#if !defined(__SANITIZE_ADDRESS__) && !defined(INTERVALE_SANITIZED)
  const rlimit limit{kMostMemory, kMostMemory};
  ::setrlimit(RLIMIT_AS, &limit);
#endif
  const rlimit none{0, 0};
  ::setrlimit(RLIMIT_CORE, &none);
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// The digits from `at` on, without leading zeros; goes behind them.
std::string_view take_number(std::string_view text, std::size_t& at) {
  while (at + 1 < text.size() && text[at] == '0' && is_digit(text[at + 1])) ++at;
  const std::size_t begin = at;
  while (at < text.size() && is_digit(text[at])) ++at;
  return text.substr(begin, at - begin);
}

bool comes_before(const std::filesystem::path& a, const std::filesystem::path& b) {
  const std::string x = a.string(), y = b.string();
  std::size_t i = 0, j = 0;
  while (i < x.size() && j < y.size()) {
    if (is_digit(x[i]) && is_digit(y[j])) {
      const std::string_view p = take_number(x, i), q = take_number(y, j);
      if (p.size() != q.size()) return p.size() < q.size();
      if (p != q) return p < q;
    } else if (x[i] != y[j]) {
      return x[i] < y[j];
    } else {
      ++i;
      ++j;
    }
  }
  const std::size_t left_x = x.size() - i, left_y = y.size() - j;
  return left_x != left_y ? left_x < left_y : x < y;
}

std::optional<ReaderRequest> parse(std::span<char* const> words) {
  ReaderRequest request;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string_view word = words[i];
    const bool has_value = i + 1 < words.size();
    if (word == "--header") {
      request.only_header = true;
    } else if (word == "--part" && has_value) {
      request.part = words[++i];
    } else if (word == "--time-point" && has_value) {
      const auto number = number_of<std::uint64_t>(words[++i]);
      if (!number) return {};
      request.time_point = *number;
    } else if (request.path.empty() && !word.starts_with('-')) {
      request.path = word;
    } else {
      return {};
    }
  }
  return request.path.empty() ? std::nullopt : std::optional(request);
}

}  // namespace

Result<void> write_samples(std::span<const std::byte> samples) {
  while (!samples.empty()) {
    const auto written = ::write(STDOUT_FILENO, samples.data(), samples.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return fail(std::string("cannot write the samples: ") + std::strerror(errno));
    samples = samples.subspan(std::size_t(written));
  }
  return {};
}

Result<void> write_header(const VolumeHeader& header) {
  const std::string line = header_line(header) + "\n";
  return write_samples(std::as_bytes(std::span(line)));
}

Result<std::vector<std::filesystem::path>> files_of(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) return std::vector{path};
  std::vector<std::filesystem::path> files;
  const auto end = std::filesystem::recursive_directory_iterator();
  for (auto entry = std::filesystem::recursive_directory_iterator(path, error); !error && entry != end; entry.increment(error)) {
    std::error_code none;
    if (!entry->is_regular_file(none) || entry->path().filename().string().starts_with('.')) continue;
    if (files.size() == kMostFiles) return fail(in_quotes(path) + " has more files than a volume has slices");
    files.push_back(entry->path());
  }
  if (error) return fail(in_quotes(path) + ": " + error.message());
  std::sort(files.begin(), files.end(), comes_before);
  return files;
}

void limit_memory_for([[maybe_unused]] std::uint64_t file_bytes) {
#if !defined(__SANITIZE_ADDRESS__) && !defined(INTERVALE_SANITIZED)
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  const std::uint64_t used = pages * std::uint64_t(::sysconf(_SC_PAGESIZE)), more = (512u << 20u) + 64 * std::min(file_bytes, kMostMemory);
  const rlimit limit{std::min<rlim_t>(kMostMemory, used + more), kMostMemory};
  ::setrlimit(RLIMIT_AS, &limit);
#endif
}

void run_reader(int argc, char** argv, Result<void> (*read)(const ReaderRequest& request)) {
  limit_memory();
  int status = 1;
  try {
    const auto request = parse(std::span(argv, std::size_t(argc)).subspan(argc > 0 ? 1 : 0));
    if (!request) {
      std::fprintf(stderr, "usage: read-FORMAT PATH [--part NAME] [--time-point N] [--header]; intervale runs it for its build and info commands\n");
      ::_exit(2);
    }
    const auto done = read(*request);
    if (!done) std::fprintf(stderr, "%s\n", done.error().message.c_str());
    status = done ? 0 : done.error().usage ? 2 : 1;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "no memory left for what a file claims to hold; is it damaged?\n");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
  }
  ::_exit(status);  // what libraries keep to the end needs no tidying up
}

}  // namespace intervale
