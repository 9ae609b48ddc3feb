#include "server/volume/child_reader.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <memory>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "common/util/printable.h"
#include "server/volume/header_line.h"

namespace intervale {
namespace {

constexpr std::size_t kMaxMessage = 1000;
constexpr auto kPatience = std::chrono::seconds(60);  // without a byte

// The folder of the shared library that this is part of; of the program, if of none.
std::filesystem::path folder_of_library() {
  Dl_info library{};
  if (::dladdr(reinterpret_cast<const void*>(&folder_of_library), &library) == 0 || library.dli_fname == nullptr) return {};
  std::error_code none;
  return std::filesystem::weakly_canonical(library.dli_fname, none).parent_path();
}

// Beside this program, as in a build folder, or in the libexec of where it or this library is installed.
std::filesystem::path path_of(const ReaderProgram& program) {
  std::error_code none;
  const auto folder = std::filesystem::read_symlink("/proc/self/exe", none).parent_path(), library = folder_of_library();
  const auto installed = std::filesystem::path("libexec") / "intervale" / program.name;
  for (const auto& candidate : {folder / program.name, folder.parent_path() / installed, library / program.name, library / installed,
                                library.parent_path() / installed, library.parent_path().parent_path() / installed}) {
    if (::access(candidate.c_str(), X_OK) == 0) return candidate;
  }
  return {};
}

class Descriptor {
 public:
  Descriptor() = default;
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { set(-1); }
  void set(int number) {
    if (number_ >= 0) ::close(number_);
    number_ = number;
  }
  [[nodiscard]] int get() const { return number_; }

 private:
  int number_ = -1;
};

// A program that writes to a pipe, and its complaints to a file in memory. Ends with this object.
class Child {
 public:
  Child() = default;
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    if (process_ <= 0) return;
    ::kill(process_, SIGKILL);
    wait();
  }

  Result<void> start(const std::filesystem::path& program, std::vector<std::string> arguments) {
    const auto failed = [&](int error) { return fail("cannot start '" + program.string() + "': " + std::strerror(error)); };
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) return failed(errno);
    output_.set(ends[0]);
    Descriptor input;
    input.set(ends[1]);
    complaints_.set(::memfd_create("complaints", MFD_CLOEXEC));
    if (complaints_.get() < 0) return failed(errno);
    arguments.insert(arguments.begin(), program.string());
    std::vector<char*> words;
    words.reserve(arguments.size() + 1);
    for (std::string& argument : arguments) words.push_back(argument.data());
    words.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    ::posix_spawn_file_actions_adddup2(&actions, input.get(), 1);
    ::posix_spawn_file_actions_adddup2(&actions, complaints_.get(), 2);
    const int error = ::posix_spawn(&process_, program.c_str(), &actions, nullptr, words.data(), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    if (error != 0) return failed(error);
    return {};
  }

  // Fewer bytes only where it writes no more.
  std::size_t read(std::span<std::byte> out) {
    std::size_t done = 0;
    auto until = std::chrono::steady_clock::now() + kPatience;
    while (done < out.size()) {
      pollfd wanted{output_.get(), POLLIN, 0};
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
      const int ready = ::poll(&wanted, 1, int(std::max(left.count(), std::chrono::milliseconds::rep(0))));
      if (ready < 0 && errno == EINTR) continue;
      if (ready <= 0) {
        is_stuck_ = true;
        break;
      }
      const auto got = ::read(output_.get(), out.data() + done, out.size() - done);
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) break;
      done += std::size_t(got);
      until = std::chrono::steady_clock::now() + kPatience;
    }
    return done;
  }

  // Up to a line break, without it.
  std::string read_line() {
    std::string line;
    std::array<std::byte, 1> next{};  // a pipe cannot give back what was read beyond the line
    while (line.size() < kMaxHeaderLine && read(next) == 1 && next[0] != std::byte('\n')) line += char(next[0]);
    return line;
  }

  // Why it has ended: what it said, or how it ended.
  Error reason(const std::string& where) {
    if (is_stuck_) return {where + ": its reader has given nothing for a minute; is it damaged?"};
    output_.set(-1);
    const int status = wait();
    const std::string text = last_complaint();
    const bool was_stopped = WIFSIGNALED(status) && WTERMSIG(status) != SIGPIPE;
    if (was_stopped) return {where + ": its reader was stopped by signal " + std::to_string(WTERMSIG(status)) + "; is it damaged?"};
    if (WIFEXITED(status) && (WEXITSTATUS(status) == 1 || WEXITSTATUS(status) == 2) && !text.empty())
      return {printable(text), WEXITSTATUS(status) == 2};
    return {where + ": its reader gave less than it promised; is it damaged?"};
  }

 private:
  // Its last line; those before are the libraries'.
  [[nodiscard]] std::string last_complaint() const {
    const off_t end = ::lseek(complaints_.get(), 0, SEEK_END), begin = std::max<off_t>(0, end - off_t(kMaxMessage));
    std::string text(std::size_t(std::max<off_t>(0, end - begin)), '\0');
    text.resize(std::size_t(std::max<ssize_t>(0, ::pread(complaints_.get(), text.data(), text.size(), begin))));
    while (text.ends_with('\n')) text.pop_back();
    return text.substr(text.rfind('\n') + 1);
  }

  int wait() {
    int status = 0;
    const pid_t process = std::exchange(process_, 0);
    while (process > 0 && ::waitpid(process, &status, 0) < 0 && errno == EINTR) {
    }
    return status;
  }
  pid_t process_ = 0;
  bool is_stuck_ = false;
  Descriptor output_, complaints_;
};

// Starts the program, and reads the header.
Result<VolumeHeader> start(Child& child, const ReaderProgram& program, const std::filesystem::path& path, const std::optional<std::string>& part,
                           std::vector<std::string> arguments) {
  const auto at = path_of(program);
  if (at.empty())
    return fail(in_quotes(path) + " is " + program.format + ", which needs the program '" + program.name + "': it is not installed beside this one");
  arguments.insert(arguments.begin(), std::filesystem::absolute(path).string());  // so that it does not begin with a dash
  if (part) arguments.insert(arguments.end(), {"--part", *part});
  if (auto started = child.start(at, std::move(arguments)); !started) return tl::unexpected<Error>(started.error());
  const std::string line = child.read_line();
  if (line.empty()) return tl::unexpected(child.reason(in_quotes(path)));
  return parse_header_line(line, in_quotes(path)).map([&](VolumeHeader header) {
    header.format = program.format;
    header.encoding = Encoding::library;
    return header;
  });
}

class LibrarySamples final : public VolumeReader {
 public:
  LibrarySamples(VolumeHeader header, std::unique_ptr<Child> child, std::string where)
      : VolumeReader(std::move(header), false), child_(std::move(child)), where_(std::move(where)) {}

 private:
  Result<void> read_next(std::span<std::byte> out) override {
    if (child_->read(out) < out.size()) return tl::unexpected(child_->reason(where_));
    return {};
  }
  std::unique_ptr<Child> child_;
  std::string where_;
};

}  // namespace

Result<VolumeHeader> read_header_by(const ReaderProgram& program, const std::filesystem::path& path, const std::optional<std::string>& part) {
  Child child;
  return start(child, program, path, part, {"--header"});
}

Result<std::unique_ptr<VolumeReader>> open_by(const ReaderProgram& program, const std::filesystem::path& path, const std::optional<std::string>& part,
                                              std::optional<std::uint64_t> time_point) {
  auto child = std::make_unique<Child>();
  auto header = start(*child, program, path, part, {"--time-point", std::to_string(time_point.value_or(0))});
  if (!header) return tl::unexpected<Error>(header.error());
  if (!part && header->parts.size() > 1) {
    std::string names;
    for (const VolumePart& one : header->parts) names += (names.empty() ? "" : ", ") + one.name + " (" + one.about + ")";
    return misuse(in_quotes(path) + " has " + std::to_string(header->parts.size()) + " " +
                  printable(header->parts_are + ": choose one with --part: " + names));
  }
  if (auto chosen = check_time_point(*header, time_point, in_quotes(path)); !chosen) return tl::unexpected<Error>(chosen.error());
  return std::make_unique<LibrarySamples>(std::move(*header), std::move(child), in_quotes(path));
}

}  // namespace intervale
