// libcurl, loaded when it is first needed: with all that it links it would take as long to load as the rest of a program.
#pragma once

#define CURL_DISABLE_TYPECHECK  // its macros stand in the way of members
#include <curl/curl.h>
#include <curl/header.h>

namespace intervale {

// The functions that are used, under their own names.
struct Libcurl {
#define INTERVALE_LIBCURL(call)                                                                                                                  \
  call(curl_easy_cleanup) call(curl_easy_getinfo) call(curl_easy_header) call(curl_easy_init) call(curl_easy_setopt) call(curl_easy_strerror)    \
      call(curl_easy_unescape) call(curl_free) call(curl_global_init) call(curl_multi_add_handle) call(curl_multi_cleanup)                       \
          call(curl_multi_info_read) call(curl_multi_init) call(curl_multi_perform) call(curl_multi_poll) call(curl_multi_remove_handle)         \
              call(curl_multi_setopt) call(curl_slist_append) call(curl_slist_free_all) call(curl_url) call(curl_url_cleanup) call(curl_url_get) \
                  call(curl_url_set)
#define INTERVALE_MEMBER(name) decltype(&::name) name = nullptr;  // NOLINT(bugprone-macro-parentheses)
  INTERVALE_LIBCURL(INTERVALE_MEMBER)
#undef INTERVALE_MEMBER
};

// Loads and starts it at the first call. Throws std::runtime_error if it is not installed. Any thread.
[[nodiscard]] const Libcurl& libcurl();

}  // namespace intervale
