// HTTP requests that run at the same time on one thread. Its .cpp file, and that of remote_url, are all that knows libcurl.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/remote/remote_access.h"
#include "common/remote/remote_url.h"
#include "common/util/result.h"

namespace intervale {

struct RemoteRequest {
  RemoteUrl url;
  std::uint64_t first = 0, last = 0;     // the range of bytes to ask for, both included
  std::vector<std::string> headers;      // "Name: value", besides those of access
  const RemoteAccess* access = nullptr;  // whose credentials are sent; nullptr: none. Must live until the request has ended
};

// The head of an answer. Texts are from outside, of at most 4 KiB; empty: the header is missing, longer, or there twice.
struct RemoteAnswer {
  long status = 0;  // of HTTP; 0: there was no answer
  std::string content_range, content_encoding, etag, last_modified, location;
  std::optional<std::uint64_t> content_length;
  std::optional<std::chrono::seconds> retry_after;
};

// How a request ended.
struct EndedTransfer {
  std::size_t id = 0;  // of start()
  RemoteAnswer answer;
  std::string failure;           // why it did not go through, without the URL; empty: it did, whatever the status is
  bool is_temporary = false;     // of the failure: trying again may help
  std::optional<Error> refusal;  // with which the taker ended it
};

// One thread. GET requests of HTTP/1.1, without following redirects. Connections are kept and used again.
class Transfers {
 public:
  struct Times {
    std::chrono::milliseconds connect{10'000};  // to resolve the name, to connect, and for the handshake of TLS
    std::chrono::seconds idle{30};              // in which less than 1 kB a second arrives; then the connection is lost
  };
  // Takes a piece of the body of an answer of 200 to 299. An error ends the transfer. Bodies of other answers are dropped.
  using Take = std::function<Result<void>(const RemoteAnswer&, std::span<const std::byte>)>;

  // authorities: as RemoteAccess has them.
  Transfers(std::size_t connections, const Times& times, std::optional<std::filesystem::path> authorities);
  Transfers(const Transfers&) = delete;
  Transfers& operator=(const Transfers&) = delete;
  ~Transfers();  // ends what still runs

  // id: the caller's name for it.
  void start(std::size_t id, const RemoteRequest& request, Take take);
  [[nodiscard]] std::size_t running() const;

  // Goes on with all of them for so long at most, or until one has ended; those that have. Throws std::bad_alloc if a
  // taker does.
  std::vector<EndedTransfer> wait(std::chrono::milliseconds time);

 private:
  struct Running;
  struct Shared;  // keeps libcurl out of this header
  std::unique_ptr<Shared> shared_;
};

}  // namespace intervale
