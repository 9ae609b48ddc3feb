// Bytes as what says where a server is and who may come in. The first byte picks: a tokens file; a pattern and a name;
// the headers Authorization and Sec-WebSocket-Protocol; an origin, a host and one origin that is allowed; a client's
// URL. What has several parts has them a line each.
#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "client/net/url.h"
#include "server/serve/access.h"
#include "tests/fuzz/lines.h"

using namespace intervale;
using intervale::testing::require;

namespace {

bool is_token(const std::string& text) {
  return !text.empty() && text.size() <= 512 &&
         text.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~+/=") == std::string::npos;
}

// By dynamic programming: how much of the name each beginning of the pattern can stand for.
bool fits(const std::string& pattern, const std::string& name) {
  std::vector<bool> reached(name.size() + 1);
  reached[0] = true;
  for (const char p : pattern) {
    std::vector<bool> next(name.size() + 1);
    if (p == '*') {
      const auto first = std::find(reached.begin(), reached.end(), true);
      std::fill(next.begin() + (first - reached.begin()), next.end(), true);
    } else {
      for (std::size_t n = 0; n < name.size(); ++n) next[n + 1] = reached[n] && (p == '?' || p == name[n]);
    }
    reached = next;
  }
  return reached.back();
}

void check_tokens(const std::string& text) {
  std::map<std::string, std::vector<std::string>> expected;
  bool sound = true;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    std::replace_if(
        line.begin(), line.end(), [](char c) { return c == '\t' || c == '\r'; }, ' ');
    std::vector<std::string> words = testing::split_trimmed(line, ' ');
    std::erase(words, "");
    words.erase(std::find_if(words.begin(), words.end(), [](const std::string& word) { return word.front() == '#'; }), words.end());
    if (words.empty()) continue;
    const std::string token = words.front();
    words.erase(words.begin());
    sound = sound && is_token(token) && expected.emplace(token, words).second;
  }
  const auto tokens = Tokens::parse(text);
  require(tokens.has_value() == (sound && !expected.empty()), "a file is read if each line is right, and one is there");
  if (!tokens) {
    const std::string& message = tokens.error().message;
    const bool told = message.starts_with("no tokens") || message.ends_with("- . _ ~ + / =") || message.ends_with("duplicate token");
    require(told && message.size() < 100, "an error tells the line, and nothing of what is in it");
    return;
  }
  for (const auto& [token, patterns] : expected) {
    const auto scope = tokens->find(token);
    require(scope != nullptr, "each token is found");
    for (const std::string name : {"engine", "scans-1", "*", ""}) {
      const bool allowed =
          patterns.empty() || std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) { return fits(pattern, name); });
      require(scope->allows(name) == allowed, "a token opens what its line says");
    }
    for (const std::string& other : {token + "x", token + token, token.substr(1), token.substr(0, token.size() - 1)}) {
      require((tokens->find(other) != nullptr) == expected.contains(other), "a token is whole or none");
    }
  }
}

std::string base64url(const std::string& bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  std::string text;
  for (std::size_t bit = 0; bit < 8 * bytes.size(); bit += 6) {
    unsigned digit = 0;
    for (std::size_t b = bit; b < bit + 6; ++b) digit = 2 * digit + (b / 8 < bytes.size() ? unsigned(bytes[b / 8]) >> (7 - b % 8) & 1u : 0u);
    text += kDigits[digit];
  }
  return text;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

void check_headers(const std::string& authorization, const std::string& subprotocols) {
  const auto token = token_of(authorization, subprotocols);
  if (lower(authorization).starts_with("bearer ")) require(token == token_of(authorization, ""), "the header goes before the subprotocol");
  if (!token) return;
  require(is_token(*token), "a token that is read could be in a file");
  require(token_of("Bearer " + *token, "") == token, "a token comes through the header");
  require(token_of("", "intervale.v1, intervale.token." + base64url(*token)) == token, "a token comes through the subprotocol");
}

void check_origin(const std::string& origin, const std::string& host, const std::string& allowed) {
  const bool own = !host.empty() && (lower(origin) == "http://" + lower(host) || lower(origin) == "https://" + lower(host));
  require(is_allowed_origin(origin, host, {}) == (origin.empty() || own), "pages of the server's own host may");
  const std::vector<std::string> list{allowed};
  require(is_allowed_origin(origin, host, list) == (origin.empty() || allowed == "*" || lower(allowed) == lower(origin)), "a list is all there is");
}

void check_url(const std::string& text) {
  const auto url = parse_url(text);
  if (!url) {
    require(url.error().usage && !url.error().message.empty(), "what is no URL is wrong usage, and told");
    return;
  }
  require(!url->host.empty() && url->host.find_first_of(std::string("\0\r\n\t @/?#[]\\", 12)) == std::string::npos, "a host is a name or an address");
  require(url->port.find_first_not_of("0123456789") == std::string::npos, "a port is a number");
  require(std::stol(url->port) >= 1 && std::stol(url->port) <= 65535, "a port is 1 to 65535");
  require(url->name.find('/') == std::string::npos, "a name is one part of a path");
  std::string name;
  for (const char c : url->name) name += c == '%' ? "%25" : std::string(1, c);
  const auto again = parse_url(url->server() + "/" + name);
  require(again && again->host == url->host && again->port == url->port && again->name == url->name && again->secure == url->secure,
          "a URL that is printed is read alike");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto lines = [=](std::size_t count) { return testing::lines_of(data + 1, size - 1, count); };
  switch (data[0] % 5) {
    case 0:
      check_tokens(lines(1)[0]);
      break;
    case 1: {
      const auto part = lines(2);
      require(Scope({part[0]}).allows(part[1]) == fits(part[0], part[1]), "a pattern fits where it should");
      break;
    }
    case 2: {
      const auto part = lines(2);
      check_headers(part[0], part[1]);
      break;
    }
    case 3: {
      const auto part = lines(3);
      check_origin(part[0], part[1], part[2]);
      break;
    }
    default:
      check_url(lines(1)[0]);
  }
  return 0;
}
