#include "common/remote/remote_file.h"

#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <deque>
#include <random>
#include <utility>

#include "common/ivm/ivm_container.h"
#include "common/remote/content_range.h"
#include "common/remote/transfers.h"

namespace intervale {
namespace {

using Clock = std::chrono::steady_clock;
using Failure = RemoteFailure;
template <class T>
using Outcome = RemoteOutcome<T>;

constexpr std::uint64_t kFirstBytes = 64 << 10;
static_assert(kFirstBytes >= kMostHeadBytes);
constexpr unsigned kMostRedirects = 5;
constexpr std::chrono::milliseconds kTurn{50};  // between looks at whether reading is to stop

std::uint64_t memory_of_machine() {
  const long pages = ::sysconf(_SC_PHYS_PAGES), size = ::sysconf(_SC_PAGESIZE);
  return pages > 0 && size > 0 ? std::uint64_t(pages) * std::uint64_t(size) : ~std::uint64_t(0);
}

bool is_redirect(long status) { return status == 301 || status == 302 || status == 303 || status == 307 || status == 308; }
bool is_temporary_status(long status) { return status == 408 || status == 429 || (status >= 500 && status < 600); }

std::string text_of(long status) {
  std::string text = "the server answers " + std::to_string(status);
  if (status == 401 || status == 403) return text + ": it wants other credentials (--header-file or --aws-sign)";
  if (status == 404 || status == 410) return text + ": there is no such file";
  return text;
}

}  // namespace

class RemoteFile::Reader {
 public:
  Reader(const RemoteUrl& url, const RemoteAccess& access, const RemoteLimits& limits, const RemoteStamp* known)
      : named_(url),
        access_(access),
        limits_(limits),
        known_(known),
        most_bytes_(std::min(limits.most_bytes, memory_of_machine())),
        url_(url),
        transfers_(limits.connections, {.connect = limits.connect_time, .idle = limits.idle_time}, access.authorities) {}

  Outcome<void> begin(const ParallelFor& parallel) {
    pieces_ = {{.bytes = kFirstBytes}};
    if (auto begun = transfer_all(parallel); !begun) return begun;
    is_begun_ = true;
    bytes_.reserve(std::size_t(stamp_.bytes));  // takes memory only as it is filled
    return {};
  }

  Outcome<void> read(std::uint64_t first_bytes, std::uint64_t last_bytes, const ParallelFor& parallel) {
    pieces_.clear();
    if (last_.empty() && last_bytes > 0) {
      last_.resize(std::size_t(std::min(last_bytes, stamp_.bytes - bytes_.size())));
      add_pieces(stamp_.bytes - last_.size(), stamp_.bytes, true, 0);
    }
    add_pieces(bytes_.size(), std::min(first_bytes, stamp_.bytes - last_.size()), false, bytes_.size());
    return transfer_all(parallel);
  }

  Outcome<void> read_places(std::span<const StreamPlace> places, const ParallelFor& parallel) {
    pieces_.clear();
    std::uint64_t to = bytes_.size();
    for (const StreamPlace& place : places) {
      add_pieces(place.offset, place.offset + place.bytes, false, to);
      to += place.bytes;
    }
    return transfer_all(parallel);
  }

  Outcome<void> read_all(const ParallelFor& parallel) {
    if (auto there = read(stamp_.bytes, 0, parallel); !there) return there;
    bytes_.insert(bytes_.end(), last_.begin(), last_.end());
    last_ = {};
    return {};
  }

  [[nodiscard]] FileEnds ends() const { return {bytes_, last_, stamp_.bytes}; }
  [[nodiscard]] const RemoteStamp& stamp() const { return stamp_; }
  [[nodiscard]] std::uint64_t requests() const { return requests_; }
  [[nodiscard]] RemoteContents take() { return {std::move(bytes_), std::move(stamp_)}; }

 private:
  // A range of the file that one request is for.
  struct Piece {
    std::uint64_t first = 0, bytes = 0;
    bool is_last = false;  // one of the file's last bytes
    std::uint64_t to = 0;  // where in last_ or bytes_ its first byte is
    std::uint64_t received = 0;
    unsigned attempts = 0;
    Clock::time_point due{};
  };

  // to: where in last_ or bytes_ they begin.
  void add_pieces(std::uint64_t from, std::uint64_t end, bool is_last, std::uint64_t to) {
    for (std::uint64_t at = from; at < end; at += limits_.range_bytes)
      pieces_.push_back({.first = at, .bytes = std::min(limits_.range_bytes, end - at), .is_last = is_last, .to = to + (at - from)});
  }

  // Runs requests for all pieces until each has succeeded.
  Outcome<void> transfer_all(const ParallelFor& parallel) {
    std::deque<std::size_t> waiting;
    for (std::size_t id = 0; id < pieces_.size(); ++id) waiting.push_back(id);
    while (!waiting.empty() || transfers_.running() > 0) {
      may_stop(parallel);
      for (std::size_t i = 0; i < waiting.size() && transfers_.running() < limits_.connections;) {
        if (pieces_[waiting[i]].due > Clock::now()) {
          ++i;
          continue;
        }
        start(waiting[i]);
        waiting.erase(waiting.begin() + std::ptrdiff_t(i));
      }
      for (const EndedTransfer& ended : transfers_.wait(kTurn)) {
        auto done = finish(ended);
        if (!done) return tl::unexpected(done.error());
        if (!*done) waiting.push_front(ended.id);
      }
    }
    return {};
  }

  void start(std::size_t id) {
    Piece& piece = pieces_[id];
    piece.received = 0;
    ++requests_;
    RemoteRequest request{url_, piece.first, piece.first + piece.bytes - 1, conditions(), url_.origin == named_.origin ? &access_ : nullptr};
    if (is_begun_) {
      // Pieces start in order: never more is allocated than has arrived and is under way. The capacity is reserved, so
      // that the bytes stay where other transfers put them.
      if (!piece.is_last) bytes_.resize(std::max(bytes_.size(), std::size_t(piece.to + piece.bytes)));
      transfers_.start(id, request,
                       [this, &piece](const RemoteAnswer& answer, std::span<const std::byte> bytes) { return take(piece, answer, bytes); });
      return;
    }
    bytes_.clear();
    is_answered_ = is_checked_ = false;
    transfers_.start(id, request, [this](const RemoteAnswer& answer, std::span<const std::byte> bytes) { return take_first(answer, bytes); });
  }

  // An answer of another state of the file is to be an error (412), not that state. Weak tags never match (RFC 9110,
  // section 13.1.1). Not If-Range: its answer would be the whole file.
  [[nodiscard]] std::vector<std::string> conditions() const {
    const RemoteStamp* const stamp = is_begun_ ? &stamp_ : known_;
    if (stamp == nullptr) return {};
    if (!is_begun_) {
      if (!stamp->etag.empty()) return {"If-None-Match: " + stamp->etag};
      return {"If-Modified-Since: " + stamp->last_modified};
    }
    if (!stamp->etag.empty() && !stamp->etag.starts_with("W/")) return {"If-Match: " + stamp->etag};
    if (!stamp->last_modified.empty()) return {"If-Unmodified-Since: " + stamp->last_modified};
    return {};
  }

  // What a request came to. False: it is to be made again, at its time or, after a redirect, at once.
  Outcome<bool> finish(const EndedTransfer& ended) {
    Piece& piece = pieces_[ended.id];
    if (failure_) return tl::unexpected(*std::exchange(failure_, std::nullopt));
    const long status = ended.answer.status;
    if (!ended.failure.empty()) {
      if (!ended.is_temporary) return fails(ended.failure);
      return try_again(piece, ended.failure, {});
    }
    if (is_temporary_status(status)) return try_again(piece, text_of(status), ended.answer.retry_after);
    if (is_begun_) {
      if (status == 412 || is_redirect(status)) return tl::unexpected(Failure{Failure::Kind::changed});
      if (status != 206) return fails(text_of(status));
      if (piece.received < piece.bytes) return fails("the server sends fewer bytes than it says");
      return true;
    }
    if (is_redirect(status)) return redirect(ended.answer);
    if (status == 304 && known_ != nullptr) return tl::unexpected(Failure{Failure::Kind::unchanged});
    if (status == 416) return fails("the file is empty, or the server cannot send its beginning");
    if (status != 200 && status != 206) return fails(text_of(status));
    return finish_first(ended.answer);
  }

  Outcome<bool> finish_first(const RemoteAnswer& answer) {
    if (!is_answered_ && !begin(answer)) return tl::unexpected(*std::exchange(failure_, std::nullopt));
    if (expected_ && bytes_.size() < *expected_) return fails("the server sends fewer bytes than it says");
    if (!is_checked_ && !check_start(bytes_.size())) return tl::unexpected(*std::exchange(failure_, std::nullopt));
    if (!expected_ && bytes_.size() < stamp_.bytes)
      return fails("the server sends " + std::to_string(bytes_.size()) + " of the file's " + std::to_string(stamp_.bytes) + " bytes");
    return true;
  }

  Outcome<bool> redirect(const RemoteAnswer& answer) {
    if (++redirects_ > kMostRedirects) return fails("the server redirects more than " + std::to_string(kMostRedirects) + " times");
    auto target = redirected(url_, answer.location);
    if (!target) return tl::unexpected(Failure{Failure::Kind::final, target.error()});
    url_ = std::move(*target);
    return false;
  }

  Outcome<bool> try_again(Piece& piece, const std::string& why, std::optional<std::chrono::seconds> wanted) {
    if (++piece.attempts >= limits_.attempts)
      return fails(why + (piece.attempts > 1 ? " (after " + std::to_string(piece.attempts) + " attempts)" : ""));
    if (wanted && *wanted > limits_.most_pause) return fails(why + ", and wants to be asked again after " + std::to_string(wanted->count()) + " s");
    const std::chrono::milliseconds longest =
        std::min<std::chrono::milliseconds>(limits_.first_pause * (1LL << std::min(piece.attempts - 1, 20U)), limits_.most_pause);
    const double share = std::uniform_real_distribution<double>(0.5, 1.0)(random_);
    const std::chrono::milliseconds pause(long(double(longest.count()) * share));
    piece.due = Clock::now() + (wanted ? std::max<std::chrono::milliseconds>(*wanted, pause) : pause);
    return false;
  }

  // A piece of the first answer's body.
  Result<void> take_first(const RemoteAnswer& answer, std::span<const std::byte> bytes) {
    if (!is_answered_ && !begin(answer)) return stop();
    const std::uint64_t most = expected_ ? *expected_ : is_checked_ ? stamp_.bytes : most_bytes_;
    if (bytes.size() > most - bytes_.size()) return refuse("the server sends more bytes than it says");
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    if (!is_checked_ && bytes_.size() >= kMostHeadBytes && !check_start({})) return stop();
    return {};
  }

  // The head of the first answer. False: failure_.
  bool begin(const RemoteAnswer& answer) {
    is_answered_ = true;
    stamp_ = {answer.etag, answer.last_modified, 0};
    total_.reset();
    if (!answer.content_encoding.empty() && answer.content_encoding != "identity")
      return set_failure("the server sends the file compressed (Content-Encoding)");
    if (answer.status == 206) {
      const auto range = parse_content_range(answer.content_range);
      if (!range || range->first != 0 || range->last + 1 != std::min(kFirstBytes, range->total))
        return set_failure("the server sends another range than was asked for (Content-Range)");
      total_ = range->total;
      expected_ = range->last + 1;
    } else {
      total_ = expected_ = answer.content_length;
    }
    if (total_ && !has_room(*total_)) return false;
    stamp_.bytes = total_.value_or(0);
    if (known_ != nullptr && stamp_ == *known_) {
      failure_ = Failure{Failure::Kind::unchanged};
      return false;
    }
    return true;
  }

  // What the file begins with. whole: its length, if that is known now. False: failure_.
  bool check_start(std::optional<std::uint64_t> whole) {
    const auto length = check_container_start(bytes_, total_ ? total_ : whole);
    if (!length) return set_failure(length.error().message);
    if (!has_room(*length)) return false;
    if (bytes_.size() > *length) return set_failure("the server sends more bytes than the file has");
    stamp_.bytes = *length;
    is_checked_ = true;
    bytes_.reserve(std::size_t(*length));
    return true;
  }

  // A piece of the body of another answer.
  Result<void> take(Piece& piece, const RemoteAnswer& answer, std::span<const std::byte> bytes) {
    if (piece.received == 0) {
      const auto range = parse_content_range(answer.content_range);
      // 200: all of another state, from a server that does not know If-Match.
      const bool is_other = answer.status == 200 || answer.etag != stamp_.etag || answer.last_modified != stamp_.last_modified ||
                            (range && range->total != stamp_.bytes);
      if (is_other) {
        failure_ = Failure{Failure::Kind::changed};
        return stop();
      }
      if (!range || range->first != piece.first || range->last + 1 != piece.first + piece.bytes)
        return refuse("the server sends another range than was asked for (Content-Range)");
      if (!answer.content_encoding.empty() && answer.content_encoding != "identity")
        return refuse("the server sends the file compressed (Content-Encoding)");
    }
    if (bytes.size() > piece.bytes - piece.received) return refuse("the server sends more bytes than it says");
    std::byte* const to = (piece.is_last ? last_ : bytes_).data() + piece.to;
    std::memcpy(to + piece.received, bytes.data(), bytes.size());
    piece.received += bytes.size();
    return {};
  }

  bool has_room(std::uint64_t bytes) {
    if (bytes <= most_bytes_) return true;
    return set_failure("the file has " + std::to_string(bytes) + " bytes; there is room for " + std::to_string(most_bytes_));
  }
  [[nodiscard]] Failure failure_of(const std::string& what) const { return {Failure::Kind::final, {url_.shown + ": " + what}}; }
  [[nodiscard]] tl::unexpected<Failure> fails(const std::string& what) const { return tl::unexpected(failure_of(what)); }
  bool set_failure(const std::string& what) {
    failure_ = failure_of(what);
    return false;
  }
  Result<void> refuse(const std::string& what) {
    set_failure(what);
    return stop();
  }
  [[nodiscard]] static Result<void> stop() { return fail("stopped"); }  // why is in failure_

  const RemoteUrl& named_;
  const RemoteAccess& access_;
  const RemoteLimits& limits_;
  const RemoteStamp* known_;  // nullptr: none
  std::uint64_t most_bytes_;
  RemoteUrl url_;  // after redirects
  unsigned redirects_ = 0;
  std::minstd_rand random_{std::random_device{}()};
  std::vector<Piece> pieces_;
  std::vector<std::byte> bytes_;  // the file's first
  std::vector<std::byte> last_;   // and its last
  std::uint64_t requests_ = 0;
  RemoteStamp stamp_;
  std::optional<std::uint64_t> total_;     // of the file, as the first answer says
  std::optional<std::uint64_t> expected_;  // of the first answer's body
  bool is_answered_ = false;               // there is the head of the first answer
  bool is_checked_ = false;                // there is the header of the file
  bool is_begun_ = false;                  // the first request is done
  std::optional<Failure> failure_;         // for which a taker has ended its transfer
  Transfers transfers_;                    // the last member: its transfers use the others
};

RemoteFile::RemoteFile(const RemoteUrl& url, const RemoteAccess& access, const RemoteLimits& limits, const RemoteStamp* known)
    : reader_(std::make_unique<Reader>(url, access, limits, known)) {}
RemoteFile::RemoteFile(RemoteFile&&) noexcept = default;
RemoteFile& RemoteFile::operator=(RemoteFile&&) noexcept = default;
RemoteFile::~RemoteFile() = default;
RemoteOutcome<void> RemoteFile::begin(const ParallelFor& parallel) { return reader_->begin(parallel); }
RemoteOutcome<void> RemoteFile::read(std::uint64_t first_bytes, std::uint64_t last_bytes, const ParallelFor& parallel) {
  return reader_->read(first_bytes, last_bytes, parallel);
}
RemoteOutcome<void> RemoteFile::read_places(std::span<const StreamPlace> places, const ParallelFor& parallel) {
  return reader_->read_places(places, parallel);
}
RemoteOutcome<void> RemoteFile::read_all(const ParallelFor& parallel) { return reader_->read_all(parallel); }
FileEnds RemoteFile::ends() const { return reader_->ends(); }
const RemoteStamp& RemoteFile::stamp() const { return reader_->stamp(); }
std::uint64_t RemoteFile::requests() const { return reader_->requests(); }
RemoteContents RemoteFile::take() && { return reader_->take(); }

}  // namespace intervale
