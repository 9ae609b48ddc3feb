// Certificates for a test, made when it runs.
#pragma once

#include <filesystem>

namespace intervale {

struct CertificateFiles {
  std::filesystem::path certificate, key;
};

struct CertificateWish {
  bool for_this_machine = true;  // 127.0.0.1 and localhost; else another.example
  bool has_expired = false;
};

// A certificate that vouches for itself, and its key: NAME.pem and NAME.key in the folder, replaced if they are there.
CertificateFiles make_certificate(const std::filesystem::path& folder, const char* name, const CertificateWish& wish = {});

}  // namespace intervale
