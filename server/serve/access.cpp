#include "server/serve/access.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <unordered_set>
#include <utility>

#include "protocol/messages.h"
#include "server/serve/header_text.h"

namespace intervale {
namespace {

constexpr std::size_t kMaxToken = 512;
constexpr std::size_t kMaxTokenFile = 1 << 20;
constexpr std::string_view kBlanks = " \t\r";

bool is_token(std::string_view text) {
  return !text.empty() && text.size() <= kMaxToken && std::all_of(text.begin(), text.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || std::string_view("-._~+/=").find(char(c)) != std::string_view::npos;
  });
}

// Greedy: the text between two stars is matched at its first place. Backtracking to the last star only is enough, so
// the time is O(pattern * name).
bool matches(std::string_view pattern, std::string_view name) {
  std::size_t p = 0, n = 0, star = std::string_view::npos, resume = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      resume = n;
    } else if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == name[n])) {
      ++p;
      ++n;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      n = ++resume;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == std::string_view::npos;
}

// Compares all characters, so that the time depends on the length of `given` only.
bool equal_in_constant_time(std::string_view given, std::string_view secret) {
  volatile unsigned difference = given.size() == secret.size() ? 0 : 1;
  for (std::size_t i = 0; i < given.size(); ++i) {
    difference = difference | (static_cast<unsigned char>(given[i]) ^ static_cast<unsigned char>(secret[i % secret.size()]));
  }
  return difference == 0;
}

std::vector<std::string> words_of(std::string_view line) {
  std::vector<std::string> words;
  for (;;) {
    const auto first = line.find_first_not_of(kBlanks);
    if (first == std::string_view::npos) return words;
    line.remove_prefix(first);
    if (line.front() == '#') return words;  // a comment
    const auto end = std::min(line.find_first_of(kBlanks), line.size());
    words.emplace_back(line.substr(0, end));
    line.remove_prefix(end);
  }
}

std::optional<std::string> from_base64url(std::string_view text) {
  std::string bytes;
  unsigned bits = 0, value = 0;
  for (const char c : text) {
    constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
    const auto digit = kDigits.find(c);
    if (digit == std::string_view::npos) return {};
    value = (value << 6 | unsigned(digit)) & 0xfff;
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += char(value >> bits & 0xff);
  }
  if (bits >= 6) return {};  // a digit too many
  return bytes;
}

}  // namespace

std::shared_ptr<const Scope> Scope::everything() {
  static const auto scope = std::make_shared<const Scope>(std::vector<std::string>());
  return scope;
}

Scope::Scope(std::vector<std::string> patterns) : patterns_(std::move(patterns)) {
  if (std::find(patterns_.begin(), patterns_.end(), "*") != patterns_.end()) patterns_.clear();
}

bool Scope::allows(std::string_view dataset) const {
  return is_everything() || std::any_of(patterns_.begin(), patterns_.end(), [&](const std::string& pattern) { return matches(pattern, dataset); });
}

Result<Tokens> Tokens::parse(std::string_view text) {
  Tokens tokens;
  std::unordered_set<std::string> seen;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const auto end = std::min(text.find('\n'), text.size());
    std::vector<std::string> words = words_of(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (words.empty()) continue;
    const auto error = [number](const char* what) { return fail("line " + std::to_string(number) + ": " + what); };
    std::string token = std::move(words.front());
    if (!is_token(token)) return error("invalid token: it must have 1 to 512 of the characters A-Z a-z 0-9 - . _ ~ + / =");
    if (!seen.insert(token).second) return error("duplicate token");
    words.erase(words.begin());
    tokens.entries_.push_back({std::move(token), words.empty() ? Scope::everything() : std::make_shared<const Scope>(std::move(words))});
  }
  if (tokens.entries_.empty()) return fail("no tokens: no client could connect");
  return tokens;
}

Result<Tokens> Tokens::load(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return fail("cannot read the tokens in " + path.string() + ": " + std::strerror(errno));
  std::string text(kMaxTokenFile + 1, '\0');
  in.read(text.data(), std::streamsize(text.size()));
  text.resize(std::size_t(in.gcount()));
  if (in.bad() || !in.eof()) return fail("cannot read the tokens in " + path.string() + ": it is larger than 1 MiB, or no file");
  auto tokens = parse(text);
  if (!tokens) return fail("cannot read the tokens in " + path.string() + ": " + tokens.error().message);
  return tokens;
}

std::shared_ptr<const Scope> Tokens::find(std::string_view token) const {
  std::shared_ptr<const Scope> found;
  for (const Entry& entry : entries_) {
    if (equal_in_constant_time(token, entry.token)) found = entry.scope;
  }
  return found;
}

std::optional<std::string> token_of(std::string_view authorization, std::string_view subprotocols) {
  constexpr std::string_view kBearer = "bearer ", kPrefix = protocol::kTokenSubprotocol;
  if (iequals(authorization.substr(0, kBearer.size()), kBearer)) {
    const std::string_view token = trimmed(authorization.substr(kBearer.size()));
    if (!is_token(token)) return {};
    return std::string(token);
  }
  while (!subprotocols.empty()) {
    const std::string_view name = split_off(subprotocols, ',');
    if (!name.starts_with(kPrefix)) continue;
    auto token = from_base64url(name.substr(kPrefix.size()));
    if (!token || !is_token(*token)) return {};
    return token;
  }
  return {};
}

bool is_allowed_origin(std::string_view origin, std::string_view host, std::span<const std::string> allowed) {
  if (origin.empty()) return true;
  if (!allowed.empty()) {
    return std::any_of(allowed.begin(), allowed.end(), [&](const std::string& one) { return one == "*" || iequals(one, origin); });
  }
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (iequals(origin.substr(0, scheme.size()), scheme)) return !host.empty() && iequals(origin.substr(scheme.size()), host);
  }
  return false;
}

}  // namespace intervale
