#include "protocol/transport/tls.h"

#include <openssl/ssl.h>
#include <openssl/x509v3.h>

#include <array>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <ctime>
#include <utility>

namespace intervale {

namespace asio = boost::asio;
namespace ssl = asio::ssl;
using asio::ip::tcp;

struct TlsContext::Parts {
  ssl::context context;
  bool is_server = false;
};

namespace {

constexpr std::size_t kRecord = 16 << 10;  // the largest TLS record
// In the wire format of ALPN.
constexpr std::array<unsigned char, 9> kProtocols{8, 'h', 't', 't', 'p', '/', '1', '.', '1'};

// Selects HTTP/1.1, if the client offers it. A client that offers only other protocols is not rejected. *chosen
// points into kProtocols.
int choose_protocol(SSL*, const unsigned char** chosen, unsigned char* size, const unsigned char* offered, unsigned int offered_size, void*) {
  unsigned char* found = nullptr;
  if (SSL_select_next_proto(&found, size, kProtocols.data(), kProtocols.size(), offered, offered_size) != OPENSSL_NPN_NEGOTIATED)
    return SSL_TLSEXT_ERR_NOACK;
  *chosen = found;
  return SSL_TLSEXT_ERR_OK;
}

void set_up(SSL_CTX* context) {
  SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION);
  SSL_CTX_set_options(context, SSL_OP_NO_COMPRESSION | SSL_OP_NO_RENEGOTIATION);
  SSL_CTX_set_mode(context, SSL_MODE_RELEASE_BUFFERS);  // saves 34 kB for each idle connection
  SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);
}

class TlsOverTcp : public Tls {
 public:
  TlsOverTcp(tcp::socket& socket, std::shared_ptr<const TlsContext> context, const std::string& host)
      : context_(std::move(context)), stream_(socket, context_->parts().context) {
    if (context_->parts().is_server) return;
    SSL* const handle = stream_.native_handle();
    boost::system::error_code error;
    asio::ip::make_address(host, error);
    if (error) {
      SSL_set_tlsext_host_name(handle, host.c_str());
      SSL_set1_host(handle, host.c_str());
    } else {
      X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(handle), host.c_str());
    }
  }

  void handshake(Done done) override {
    stream_.async_handshake(context_->parts().is_server ? ssl::stream_base::server : ssl::stream_base::client, std::move(done));
  }
  void read_some(asio::mutable_buffer buffer, DoneBytes done) override { stream_.async_read_some(buffer, std::move(done)); }
  asio::mutable_buffer write_buffer() override { return asio::buffer(record_); }
  void write_some(std::size_t bytes, DoneBytes done) override { stream_.async_write_some(asio::buffer(record_.data(), bytes), std::move(done)); }
  void shutdown(Done done) override { stream_.async_shutdown(std::move(done)); }
  std::string verify_error() const override {
    const long result = SSL_get_verify_result(const_cast<ssl::stream<tcp::socket&>&>(stream_).native_handle());
    return result == X509_V_OK ? std::string() : X509_verify_cert_error_string(result);
  }

 private:
  std::shared_ptr<const TlsContext> context_;
  ssl::stream<tcp::socket&> stream_;
  std::array<char, kRecord> record_{};
};

}  // namespace

TlsContext::TlsContext(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
TlsContext::~TlsContext() = default;

Result<std::shared_ptr<const TlsContext>> TlsContext::server(const std::filesystem::path& certificate, const std::filesystem::path& key) {
  std::unique_ptr<Parts> parts(new Parts{ssl::context(ssl::context::tls_server), true});
  SSL_CTX* const handle = parts->context.native_handle();
  set_up(handle);
  SSL_CTX_set_alpn_select_cb(handle, &choose_protocol, nullptr);
  boost::system::error_code error;
  parts->context.use_certificate_chain_file(certificate.string(), error);
  if (error) return fail("cannot read the certificate " + certificate.string() + ": " + error.message());
  parts->context.use_private_key_file(key.string(), ssl::context::pem, error);
  if (!error && SSL_CTX_check_private_key(handle) != 1) error = boost::system::errc::make_error_code(boost::system::errc::invalid_argument);
  if (error) return fail("cannot read the key " + key.string() + ", or it does not match " + certificate.string() + ": " + error.message());
  return std::shared_ptr<const TlsContext>(new TlsContext(std::move(parts)));
}

Result<std::shared_ptr<const TlsContext>> TlsContext::client(const std::optional<std::filesystem::path>& authorities) {
  std::unique_ptr<Parts> parts(new Parts{ssl::context(ssl::context::tls_client), false});
  SSL_CTX* const handle = parts->context.native_handle();
  set_up(handle);
  SSL_CTX_set_alpn_protos(handle, kProtocols.data(), kProtocols.size());
  parts->context.set_verify_mode(ssl::verify_peer);
  boost::system::error_code error;
  if (authorities) {
    // Every certificate in the file is trusted itself: a server's own certificate is enough, without its issuer.
    X509_VERIFY_PARAM_set_flags(SSL_CTX_get0_param(handle), X509_V_FLAG_PARTIAL_CHAIN);
    parts->context.load_verify_file(authorities->string(), error);
    if (error) return fail("cannot read the certificates in " + authorities->string() + ": " + error.message());
  } else {
    parts->context.set_default_verify_paths(error);  // not an error if there is none: then no certificate is trusted
  }
  return std::shared_ptr<const TlsContext>(new TlsContext(std::move(parts)));
}

std::chrono::system_clock::time_point TlsContext::expires() const {
  const X509* const certificate = SSL_CTX_get0_certificate(parts_->context.native_handle());
  std::tm time{};
  if (certificate == nullptr || ASN1_TIME_to_tm(X509_get0_notAfter(certificate), &time) != 1) return {};
  return std::chrono::system_clock::from_time_t(::timegm(&time));
}

std::unique_ptr<Tls> make_tls(tcp::socket& socket, std::shared_ptr<const TlsContext> context, const std::string& host) {
  return std::make_unique<TlsOverTcp>(socket, std::move(context), host);
}

}  // namespace intervale
