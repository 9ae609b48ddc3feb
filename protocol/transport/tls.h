// TLS behind a narrow interface: OpenSSL, and what Asio makes of it, take long to compile and stay in tls.cpp.
#pragma once

#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/system/error_code.hpp>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/util/result.h"

namespace intervale {

// What one end needs to speak TLS (1.2 at least). Immutable and shared; each connection keeps what it began with.
class TlsContext {
 public:
  // A server that shows the certificates of a PEM file, its own first, and has the key of another. Failures: files that cannot be read or do not
  // belong together.
  static Result<std::shared_ptr<const TlsContext>> server(const std::filesystem::path& certificate, const std::filesystem::path& key);

  // A client that trusts the certificates of a PEM file, or without one those that the system does. Failures: a file that cannot be read.
  static Result<std::shared_ptr<const TlsContext>> client(const std::optional<std::filesystem::path>& authorities);

  ~TlsContext();
  TlsContext(const TlsContext&) = delete;
  TlsContext& operator=(const TlsContext&) = delete;

  // When the server's own certificate expires.
  [[nodiscard]] std::chrono::system_clock::time_point expires() const;

  struct Parts;
  [[nodiscard]] Parts& parts() const { return *parts_; }

 private:
  explicit TlsContext(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

// One connection's TLS. Operations are started and complete on the socket's executor; one read, and one of the others, at a time.
class Tls {
 public:
  using Error = boost::system::error_code;
  using Done = std::function<void(Error)>;
  using DoneBytes = std::function<void(Error, std::size_t)>;

  virtual ~Tls() = default;
  virtual void handshake(Done done) = 0;
  virtual void read_some(boost::asio::mutable_buffer buffer, DoneBytes done) = 0;
  // Room for what is to be written next: copy there, then write_some so many bytes of it. Room is taken when done.
  [[nodiscard]] virtual boost::asio::mutable_buffer room() = 0;
  virtual void write_some(std::size_t bytes, DoneBytes done) = 0;
  virtual void shutdown(Done done) = 0;  // says good-bye, and waits for the other side's
  // Why the other side's certificate was not trusted, for people; empty if that is not what went wrong.
  [[nodiscard]] virtual std::string distrust() const = 0;
};

// Over a connected socket, which must outlive it. host: whom a client means to talk to, a name or an address; of no meaning to a server.
[[nodiscard]] std::unique_ptr<Tls> make_tls(boost::asio::ip::tcp::socket& socket, std::shared_ptr<const TlsContext> context, const std::string& host);

}  // namespace intervale
