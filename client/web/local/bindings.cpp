// A data set in a file, shown without a server: the sending side of its sessions, as the browser's worker sees it. Bytes
// of a file and of messages in, bytes of messages out. No I/O.
//
// Texts that are returned say what went wrong; empty ones, that nothing did. Buffers that are returned are the caller's.
#include <emscripten/bind.h>
#include <emscripten/val.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/ivm/load_volume.h"
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
  // For the bytes of the file.
  val inbox(std::size_t size) { return inbox_.of(size); }
  // Reads the inbox, and frees it. name: the file's, without folders and extension.
  std::string load(const std::string& name) {
    auto read = decode_volume(std::as_bytes(std::span(inbox_.bytes())), name);
    inbox_.free();
    if (!read) return read.error().message;
    if (auto fits = protocol::check_sendable(read->description()); !fits) return fits.error().message;
    volume_ = std::make_shared<const IntervalVolume>(std::move(*read));
    return {};
  }
  // What a server's /api/datasets/NAME tells.
  [[nodiscard]] std::string describe() const { return data_set_json(*volume_); }
  [[nodiscard]] const std::shared_ptr<const IntervalVolume>& volume() const { return volume_; }

 private:
  Inbox inbox_;
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
    fault_ = message ? state_.receive(*message) : protocol::Fault{protocol::CloseCode::malformed, message.error().message};
    is_fault_sent_ = false;
  }
  // Works for a while: the next message, or null if there is none yet. See is_idle().
  val step() {
    if (fault_) return std::exchange(is_fault_sent_, true) ? val::null() : buffer_of(*fault_);
    if (const auto message = state_.next()) return buffer_of(*message);
    if (state_.waits()) (void)worker_.work();
    return val::null();
  }
  // Nothing is left to do before the next message.
  [[nodiscard]] bool is_idle() const { return fault_ ? is_fault_sent_ : !state_.has_work() && !state_.waits(); }

 private:
  static val buffer_of(const protocol::ServerMessage& message) {
    const auto bytes = protocol::encode(message);
    return val(emscripten::typed_memory_view(bytes.size(), bytes.data())).call<val>("slice")["buffer"];
  }

  Inbox inbox_;
  LocalWorker worker_;
  SessionState state_;
  std::optional<protocol::Fault> fault_;  // why the session ended
  bool is_fault_sent_ = false;
};

}  // namespace

EMSCRIPTEN_BINDINGS(intervale_local) {
  emscripten::class_<LocalDataSet>("LocalDataSet")
      .constructor<>()
      .function("inbox", &LocalDataSet::inbox)
      .function("load", &LocalDataSet::load)
      .function("describe", &LocalDataSet::describe);
  emscripten::class_<LocalSession>("LocalSession")
      .constructor<const LocalDataSet&>()
      .function("inbox", &LocalSession::inbox)
      .function("receive", &LocalSession::receive)
      .function("step", &LocalSession::step)
      .function("isIdle", &LocalSession::is_idle);
}

}  // namespace intervale
