// TLS behind a narrow interface: OpenSSL and asio::ssl take long to compile, and are included in tls.cpp only.
#pragma once

#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/system/error_code.hpp>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/util/result.h"

namespace intervale {

// Certificates and settings of one end; TLS 1.2 or later. Immutable and shared; a connection keeps the context it
// began with.
class TlsContext {
 public:
  // A server with the certificate chain of a PEM file, its own certificate first, and the private key of another.
  // Failures: files that cannot be read; a key that does not match the certificate.
  static Result<std::shared_ptr<const TlsContext>> server(const std::filesystem::path& certificate, const std::filesystem::path& key);

  // A client that trusts the certificates of a PEM file, or if there is none those of the system. Failure: the file
  // cannot be read.
  static Result<std::shared_ptr<const TlsContext>> client(const std::optional<std::filesystem::path>& authorities);

  ~TlsContext();
  TlsContext(const TlsContext&) = delete;
  TlsContext& operator=(const TlsContext&) = delete;

  // The expiry of the server's own certificate.
  [[nodiscard]] std::chrono::system_clock::time_point expires() const;

  struct Parts;
  [[nodiscard]] Parts& parts() const { return *parts_; }

 private:
  explicit TlsContext(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

// TLS of one connection. Operations start and complete on the socket's executor. At a time: one read, and one other
// operation.
class Tls {
 public:
  using Error = boost::system::error_code;
  using Done = std::function<void(Error)>;
  using DoneBytes = std::function<void(Error, std::size_t)>;

  virtual ~Tls() = default;
  virtual void handshake(Done done) = 0;
  virtual void read_some(boost::asio::mutable_buffer buffer, DoneBytes done) = 0;
  // The buffer for the next write: copy the bytes there, then call write_some() with their number. In use until that
  // completes.
  [[nodiscard]] virtual boost::asio::mutable_buffer write_buffer() = 0;
  virtual void write_some(std::size_t bytes, DoneBytes done) = 0;
  virtual void shutdown(Done done) = 0;  // sends close_notify, and waits for the peer's
  // Why the peer's certificate was rejected, for users; empty if it was not.
  [[nodiscard]] virtual std::string verify_error() const = 0;
};

// TLS over a connected socket, which must outlive the result. host: the name or address that the peer's certificate
// must have; ignored by a server.
[[nodiscard]] std::unique_ptr<Tls> make_tls(boost::asio::ip::tcp::socket& socket, std::shared_ptr<const TlsContext> context, const std::string& host);

}  // namespace intervale
