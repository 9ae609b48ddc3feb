#include "common/remote/libcurl.h"

#include <dlfcn.h>

#include <stdexcept>
#include <string>

namespace intervale {
namespace {

Libcurl load() {
  void* const library = ::dlopen("libcurl.so.4", RTLD_NOW | RTLD_LOCAL);  // stays loaded
  if (library == nullptr) throw std::runtime_error(std::string("files on web servers need libcurl: ") + ::dlerror());
  Libcurl curl;
#define INTERVALE_FIND(name)                                                  \
  curl.name = reinterpret_cast<decltype(curl.name)>(::dlsym(library, #name)); \
  if (curl.name == nullptr) throw std::runtime_error("libcurl is too old: it lacks " #name);
  INTERVALE_LIBCURL(INTERVALE_FIND)
#undef INTERVALE_FIND
  if (curl.curl_global_init(CURL_GLOBAL_DEFAULT) != CURLE_OK) throw std::runtime_error("libcurl cannot be started");
  return curl;
}

}  // namespace

const Libcurl& libcurl() {
  static const Libcurl kLoaded = load();
  return kLoaded;
}

}  // namespace intervale
