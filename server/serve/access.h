// Access control: bearer tokens with their scopes, and the origins of pages. No I/O except in Tokens::load().
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/util/result.h"

namespace intervale {

// The data sets that a token grants. Immutable and shared.
class Scope {
 public:
  explicit Scope(std::vector<std::string> patterns);  // empty, or with a pattern *: everything
  static std::shared_ptr<const Scope> everything();

  // Whether a pattern matches: * stands for any characters, ? for one byte.
  [[nodiscard]] bool allows(std::string_view dataset) const;
  [[nodiscard]] bool is_everything() const { return patterns_.empty(); }

 private:
  std::vector<std::string> patterns_;  // empty: everything
};

// The tokens of a file. Errors never contain a token. Reading is safe from any thread.
class Tokens {
 public:
  // One token on each line, followed by patterns of the data sets that it grants, separated by blanks; no pattern:
  // all data sets. A word that begins with # starts a comment. Tokens are 1 to 512 of A-Z a-z 0-9 - . _ ~ + / =.
  // Failures, with the number of the line: an invalid token, a token that occurs twice; no token at all.
  static Result<Tokens> parse(std::string_view text);
  static Result<Tokens> load(const std::filesystem::path& path);  // 1 MiB at most

  // nullptr if there is no such token. The time does not depend on how many characters are right.
  [[nodiscard]] std::shared_ptr<const Scope> find(std::string_view token) const;

 private:
  struct Entry {
    std::string token;
    std::shared_ptr<const Scope> scope;
  };
  std::vector<Entry> entries_;
};

// The token of "Authorization: Bearer TOKEN", or else of the offered subprotocol intervale.token.BASE64URL (without
// padding): browsers let a page set no other header of an upgrade. nullopt if there is none, or if it is malformed.
[[nodiscard]] std::optional<std::string> token_of(std::string_view authorization, std::string_view subprotocols);

// Whether a page of that origin may open sessions: it is one of `allowed`, where * is any, or, if `allowed` is empty,
// it has the host of the request. Programs send no origin, and are allowed.
[[nodiscard]] bool is_allowed_origin(std::string_view origin, std::string_view host, std::span<const std::string> allowed);

}  // namespace intervale
