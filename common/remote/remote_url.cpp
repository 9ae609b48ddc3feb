#include "common/remote/remote_url.h"

#include <algorithm>
#include <cctype>
#include <memory>
#include <optional>
#include <utility>

#include "common/remote/libcurl.h"
#include "common/util/printable.h"

namespace intervale {
namespace {

// The parser of the library that makes the requests: no other could see another host in the same text.
struct UrlCleanup {
  void operator()(CURLU* url) const { libcurl().curl_url_cleanup(url); }
};
using Parsed = std::unique_ptr<CURLU, UrlCleanup>;

struct CurlFree {
  void operator()(char* text) const { libcurl().curl_free(text); }
};

// nullopt: the URL has no such part, or an empty one.
std::optional<std::string> part(const Parsed& url, CURLUPart which, unsigned flags = 0) {
  char* text = nullptr;
  if (libcurl().curl_url_get(url.get(), which, &text, flags) != CURLUE_OK || text == nullptr) return {};
  const std::unique_ptr<char, CurlFree> owner(text);
  return *text == '\0' ? std::nullopt : std::optional<std::string>(text);
}

std::string lower(std::string_view text) {
  std::string small(text);
  std::transform(small.begin(), small.end(), small.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return small;
}

std::string unescaped(const std::string& text) {
  int size = 0;
  const std::unique_ptr<char, CurlFree> plain(libcurl().curl_easy_unescape(nullptr, text.c_str(), int(text.size()), &size));
  return plain ? std::string(plain.get(), std::size_t(size)) : text;
}

// Without a query, also of a text that is no URL.
std::string without_query(std::string_view text) { return printable(text.substr(0, text.find_first_of("?#"))); }

Result<RemoteUrl> read_parts(const Parsed& url, std::string_view given) {
  const auto wrong = [given](const char* what) { return misuse("invalid URL '" + without_query(given) + "': " + what); };
  // Not shown: it may be a password.
  if (part(url, CURLUPART_USER) || part(url, CURLUPART_PASSWORD)) return misuse("invalid URL: a user and a password belong into --header-file");
  const auto scheme = part(url, CURLUPART_SCHEME);
  if (scheme != "http" && scheme != "https") return wrong("expected http:// or https://");
  const auto host = part(url, CURLUPART_HOST), port = part(url, CURLUPART_PORT, CURLU_DEFAULT_PORT), path = part(url, CURLUPART_PATH);
  if (!host || !port || !path) return wrong("it names no host");
  libcurl().curl_url_set(url.get(), CURLUPART_FRAGMENT, nullptr, 0);
  const auto text = part(url, CURLUPART_URL);
  if (!text) return wrong("it cannot be requested");
  std::string name = unescaped(path->substr(path->rfind('/') + 1));
  if (name.ends_with(".ivm")) name.resize(name.size() - 4);
  return RemoteUrl{*text, *scheme + "://" + lower(*host) + ":" + *port, without_query(*text), std::move(name), scheme == "https"};
}

}  // namespace

bool is_remote_url(std::string_view text) {
  const std::string scheme = lower(text.substr(0, text.find("://")));
  return text.find("://") != std::string_view::npos && (scheme == "http" || scheme == "https");
}

std::string shown_url(std::string_view text) { return is_remote_url(text) ? without_query(text) : std::string(text); }

Result<RemoteUrl> parse_remote_url(std::string_view text) {
  const Parsed url(libcurl().curl_url());
  if (!is_remote_url(text) || text.find('\0') != std::string_view::npos ||
      libcurl().curl_url_set(url.get(), CURLUPART_URL, std::string(text).c_str(), 0) != CURLUE_OK) {
    // What stands before an @ may be a password.
    if (text.find('@') != std::string_view::npos) return misuse("invalid URL: expected http://HOST/FILE.ivm or https://HOST/FILE.ivm");
    return misuse("invalid URL '" + without_query(text) + "': expected http://HOST/FILE.ivm or https://HOST/FILE.ivm");
  }
  auto read = read_parts(url, text);
  if (read && read->name.empty()) return misuse("invalid URL '" + read->shown + "': it names no file");
  return read;
}

Result<RemoteUrl> redirected(const RemoteUrl& url, const std::string& location) {
  const Parsed parsed(libcurl().curl_url());
  const auto fails = [&url](const char* what) { return fail(url.shown + ": " + what); };
  if (libcurl().curl_url_set(parsed.get(), CURLUPART_URL, url.text.c_str(), 0) != CURLUE_OK) return fails("cannot be requested");
  if (location.empty()) return fails("the server redirects to nowhere");
  if (libcurl().curl_url_set(parsed.get(), CURLUPART_URL, location.c_str(), 0) != CURLUE_OK) return fails("the server redirects to an invalid URL");
  auto target = read_parts(parsed, location);
  if (!target) return fails("the server redirects to an invalid URL");
  if (url.secure && !target->secure) return fails("the server redirects from https to http");
  target->name = url.name;
  return target;
}

}  // namespace intervale
