// A data set in a file, shown without a server: the sending side of its sessions, as the browser's worker sees it. Bytes
// of a file and of messages in, bytes of messages out. No I/O.
//
// Texts that are returned say what went wrong; empty ones, that nothing did. Buffers that are returned are the caller's.
#include <emscripten/bind.h>
#include <emscripten/val.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/ivm/coarse_scales.h"
#include "common/ivm/load_volume.h"
#include "common/ivm/value_file.h"
#include "protocol/codec.h"
#include "protocol/session/data_set_json.h"
#include "protocol/session/local_worker.h"
#include "protocol/session/session_state.h"

namespace intervale {
namespace {

using emscripten::val;

// Room for bytes from outside; valid until the next call.
class Inbox {
 public:
  val of(std::size_t size) {
    bytes_.resize(size);
    return val(emscripten::typed_memory_view(bytes_.size(), bytes_.data()));
  }
  [[nodiscard]] const std::vector<std::uint8_t>& bytes() const { return bytes_; }
  void free() { bytes_ = {}; }

 private:
  std::vector<std::uint8_t> bytes_;
};

class LocalDataSet {
 public:
  // For bytes of the file.
  val inbox(std::size_t size) { return inbox_.of(size); }
  // The bytes that a file begins with are in the inbox: finds what can be loaded before all of it (coarse_scales.h).
  // file_bytes: its length. name: the file's, without folders and extension.
  std::string begin(const std::string& name, double file_bytes) {
    name_ = name;
    file_bytes_ = std::uint64_t(file_bytes);
    auto scales = coarse_scales(std::as_bytes(std::span(inbox_.bytes())), file_bytes_);
    if (!scales) return scales.error().message;
    coarse_ = std::move(*scales);
    start_bytes_ = intervale::start_bytes(std::as_bytes(std::span(inbox_.bytes())), file_bytes_);
    return {};
  }
  // How many bytes begin() needs: if more than it had, it is to be called again with these.
  [[nodiscard]] double start_bytes() const { return double(start_bytes_); }
  [[nodiscard]] std::size_t coarse_count() const { return coarse_.size(); }
  // How many bytes at the file's beginning and at its end are needed to load the i-th of those.
  [[nodiscard]] double first_bytes(std::size_t i) const { return double(coarse_[i].first_bytes); }
  [[nodiscard]] double last_bytes(std::size_t i) const { return double(coarse_[i].last_bytes); }
  // Reads these bytes from the inbox, the first ones first.
  std::string load_coarse(std::size_t i) {
    const auto bytes = std::as_bytes(std::span(inbox_.bytes()));
    const auto first = std::size_t(coarse_[i].first_bytes), last = std::size_t(coarse_[i].last_bytes);
    if (bytes.size() != first + last) return "the bytes are not as many as were asked for";
    return take(decode_coarse({bytes.first(first), bytes.last(last), file_bytes_}, coarse_[i], name_));
  }
  // Reads all of the file from the inbox, and frees that.
  std::string load() {
    try {
      auto read = decode_volume(std::as_bytes(std::span(inbox_.bytes())), name_, serial, room());
      inbox_.free();
      return take(std::move(read));
    } catch (const NoRoom&) {
      inbox_.free();
      return kTooLarge;
    }
  }
  // Whether there is memory for the i-th of the coarse scales, or after those for all of the file, once others are
  // loaded: empty, or what to tell.
  [[nodiscard]] std::string check_room(std::size_t i) const {
    if (!volume_) return {};
    const Description& d = volume_->description();
    return memory_to_decode(d.grid, d.format.last, i < coarse_.size() ? coarse_[i].finest : 0) > room() ? kTooLarge : "";
  }
  // What a server's /api/datasets/NAME tells.
  [[nodiscard]] std::string describe() const { return data_set_json(*volume_); }
  [[nodiscard]] const std::shared_ptr<const IntervalVolume>& volume() const { return volume_; }

 private:
  static constexpr std::uint64_t kMostMemory = std::uint64_t(7) << 29;  // bytes, of 4 GiB
  static constexpr const char* kTooLarge = "all of it takes more memory than a page has, 4 GB: have it served by intervale serve";
  // Besides the file, and what was loaded of it.
  [[nodiscard]] std::uint64_t room() const {
    const std::uint64_t taken = file_bytes_ + (volume_ ? volume_->memory_bytes() : 0);
    return kMostMemory - std::min(taken, kMostMemory);
  }
  std::string take(Result<IntervalVolume> read) {
    if (!read) return read.error().message;
    if (auto fits = protocol::check_sendable(read->description()); !fits) return fits.error().message;
    volume_ = std::make_shared<const IntervalVolume>(std::move(*read));
    return {};
  }

  Inbox inbox_;
  std::string name_;
  std::uint64_t file_bytes_ = 0, start_bytes_ = 0;
  std::vector<CoarseScales> coarse_;
  std::shared_ptr<const IntervalVolume> volume_;
};

// Of a data set that was loaded, and outlives it.
class LocalSession {
 public:
  explicit LocalSession(const LocalDataSet& set)
      : state_([&set](const std::string&) -> tl::expected<SessionState::Volume, protocol::Fault> { return set.volume(); }, worker_) {}

  // For one message.
  val inbox(std::size_t size) { return inbox_.of(size); }
  // Handles the message in the inbox.
  void receive() {
    if (fault_) return;
    const auto message = protocol::decode_client_message(inbox_.bytes());
    is_stuck_ = false;
    fault_ = message ? state_.receive(*message) : protocol::Fault{protocol::CloseCode::malformed, message.error().message};
    if (is_grown_) state_.end_growth();
    is_fault_sent_ = false;
  }
  // Works for a while: the next message, or null if there is none yet. See is_idle().
  val step() {
    if (fault_) return std::exchange(is_fault_sent_, true) ? val::null() : buffer_of(*fault_);
    if (const auto message = state_.next()) return buffer_of(*message);
    is_stuck_ = state_.waits() && !worker_.work();
    return val::null();
  }
  // More of the data set was loaded.
  void grow() { is_stuck_ = false; }
  // Nothing more of it will be: views are done with what is there.
  void end_growth() {
    is_grown_ = true;
    is_stuck_ = false;
    state_.end_growth();
  }
  // Nothing is left to do before the next message, or before the data set grows.
  [[nodiscard]] bool is_idle() const { return fault_ ? is_fault_sent_ : !state_.has_work() && (!state_.waits() || is_stuck_); }

 private:
  static val buffer_of(const protocol::ServerMessage& message) {
    const auto bytes = protocol::encode(message);
    return val(emscripten::typed_memory_view(bytes.size(), bytes.data())).call<val>("slice")["buffer"];
  }

  Inbox inbox_;
  LocalWorker worker_;
  SessionState state_;
  bool is_grown_ = false;                 // end_growth()
  bool is_stuck_ = false;                 // it waits, and the worker has nothing to do: the data set has to grow
  std::optional<protocol::Fault> fault_;  // why the session ended
  bool is_fault_sent_ = false;
};

}  // namespace

EMSCRIPTEN_BINDINGS(intervale_local) {
  emscripten::class_<LocalDataSet>("LocalDataSet")
      .constructor<>()
      .function("inbox", &LocalDataSet::inbox)
      .function("begin", &LocalDataSet::begin)
      .function("startBytes", &LocalDataSet::start_bytes)
      .function("coarseCount", &LocalDataSet::coarse_count)
      .function("firstBytes", &LocalDataSet::first_bytes)
      .function("lastBytes", &LocalDataSet::last_bytes)
      .function("loadCoarse", &LocalDataSet::load_coarse)
      .function("load", &LocalDataSet::load)
      .function("checkRoom", &LocalDataSet::check_room)
      .function("describe", &LocalDataSet::describe);
  emscripten::class_<LocalSession>("LocalSession")
      .constructor<const LocalDataSet&>()
      .function("inbox", &LocalSession::inbox)
      .function("receive", &LocalSession::receive)
      .function("step", &LocalSession::step)
      .function("grow", &LocalSession::grow)
      .function("endGrowth", &LocalSession::end_growth)
      .function("isIdle", &LocalSession::is_idle);
}

}  // namespace intervale
