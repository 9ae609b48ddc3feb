#include "tests/support/certificates.h"

#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>

namespace intervale {
namespace {

void must(bool done) {
  if (!done) throw std::runtime_error("no certificate could be made");
}

struct Close {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

template <class Write>
void write(const std::filesystem::path& path, Write write_to) {
  std::filesystem::remove(path);
  const std::unique_ptr<std::FILE, Close> file(std::fopen(path.c_str(), "wb"));
  must(file && write_to(file.get()) == 1);
}

}  // namespace

CertificateFiles make_certificate(const std::filesystem::path& folder, const char* name, const CertificateWish& wish) {
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(EVP_EC_gen("P-256"), &EVP_PKEY_free);
  const std::unique_ptr<X509, decltype(&X509_free)> certificate(X509_new(), &X509_free);
  must(key && certificate);
  constexpr long kDay = 24 * 60 * 60;
  std::uint32_t serial = 0;
  must(RAND_bytes(reinterpret_cast<unsigned char*>(&serial), sizeof serial) == 1);
  X509_set_version(certificate.get(), X509_VERSION_3);
  ASN1_INTEGER_set_uint64(X509_get_serialNumber(certificate.get()), serial);
  X509_gmtime_adj(X509_getm_notBefore(certificate.get()), -2 * kDay);
  X509_gmtime_adj(X509_getm_notAfter(certificate.get()), wish.has_expired ? -kDay : kDay);
  X509_set_pubkey(certificate.get(), key.get());
  X509_NAME* const subject = X509_get_subject_name(certificate.get());
  X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_ASC, reinterpret_cast<const unsigned char*>("intervale test"), -1, -1, 0);
  X509_set_issuer_name(certificate.get(), subject);
  const char* const names = wish.for_this_machine ? "IP:127.0.0.1,DNS:localhost" : "DNS:another.example";
  const std::unique_ptr<X509_EXTENSION, decltype(&X509_EXTENSION_free)> extension(X509V3_EXT_conf_nid(nullptr, nullptr, NID_subject_alt_name, names),
                                                                                  &X509_EXTENSION_free);
  must(extension && X509_add_ext(certificate.get(), extension.get(), -1) == 1);
  must(X509_sign(certificate.get(), key.get(), EVP_sha256()) != 0);
  CertificateFiles files{folder / (std::string(name) + ".pem"), folder / (std::string(name) + ".key")};
  write(files.certificate, [&](std::FILE* file) { return PEM_write_X509(file, certificate.get()); });
  write(files.key, [&](std::FILE* file) { return PEM_write_PrivateKey(file, key.get(), nullptr, nullptr, 0, nullptr, nullptr); });
  return files;
}

}  // namespace intervale
