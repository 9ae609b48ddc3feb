#include "tests/support/process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <stdexcept>

namespace intervale {
namespace {

using Clock = std::chrono::steady_clock;

struct Pipe {
  std::array<int, 2> ends{};
  Pipe() {
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    (void)::fcntl(ends[1], F_SETPIPE_SZ, 1 << 20);  // a program does not wait for a test that does not read yet
  }
};

// Appends what there is; false at the end.
bool read_some(int& descriptor, std::string& text) {
  std::array<char, 4096> bytes{};
  const ssize_t count = ::read(descriptor, bytes.data(), bytes.size());
  if (count > 0) {
    text.append(bytes.data(), static_cast<std::size_t>(count));
    return true;
  }
  ::close(descriptor);
  descriptor = -1;
  return false;
}

}  // namespace

Process::Process(const std::vector<std::string>& arguments) {
  const Pipe out;
  const Pipe err;
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  pid_ = ::fork();
  if (pid_ < 0) throw std::runtime_error("no fork");
  if (pid_ == 0) {
    ::dup2(out.ends[1], STDOUT_FILENO);
    ::dup2(err.ends[1], STDERR_FILENO);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  ::close(out.ends[1]);
  ::close(err.ends[1]);
  out_ = out.ends[0];
  err_ = err.ends[0];
}

Process::~Process() {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  if (out_ >= 0) ::close(out_);
  if (err_ >= 0) ::close(err_);
}

void Process::signal(int number) const {
  if (const int pid = pid_; pid > 0) ::kill(pid, number);
}

bool Process::pump(Clock::time_point until) {
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now()).count();
  if (left <= 0 || (out_ < 0 && err_ < 0)) return false;
  std::array<pollfd, 2> descriptors{{{out_, POLLIN, 0}, {err_, POLLIN, 0}}};
  ::poll(descriptors.data(), descriptors.size(), static_cast<int>(left));
  if (descriptors[0].revents != 0) read_some(out_, result_.out);
  if (descriptors[1].revents != 0) read_some(err_, result_.err);
  return true;
}

std::optional<std::string> Process::wait_for(const std::string& text) {
  const auto until = Clock::now() + std::chrono::seconds(60);
  while (result_.err.find(text) == std::string::npos) {
    if (!pump(until)) return {};
  }
  return result_.err;
}

Finished Process::wait() {
  const auto until = Clock::now() + std::chrono::seconds(120);
  while (pump(until)) {
  }
  if (Clock::now() >= until) signal(SIGKILL);
  int status = 0;
  ::waitpid(pid_, &status, 0);
  pid_ = -1;
  result_.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result_;
}

// LeakSanitizer itself crashes once in some thousand programs, where threads end while it looks at them: then the program
// is run again. What it finds, it says in other words.
Finished run(const std::vector<std::string>& arguments) {
  const Finished done = Process(arguments).wait();
  return done.err.find("LeakSanitizer has encountered a fatal error") == std::string::npos ? done : Process(arguments).wait();
}

}  // namespace intervale
