// Who may come in, and to what: bearer tokens with their scopes, and the origins of pages. No I/O but in Tokens::load().
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

// The data sets that somebody may know of. Immutable and shared.
class Scope {
 public:
  explicit Scope(std::vector<std::string> patterns);  // none, or one that is *: everything
  static std::shared_ptr<const Scope> everything();

  // By a pattern: * stands for any characters, ? for one byte.
  [[nodiscard]] bool allows(std::string_view dataset) const;
  [[nodiscard]] bool is_everything() const { return patterns_.empty(); }

 private:
  std::vector<std::string> patterns_;  // none: everything
};

// The tokens of a file. What they are is never part of an error. Reading is safe from any thread.
class Tokens {
 public:
  // A token a line, then, each after blanks, the data sets it is for, as patterns; none: all. Empty lines and those that begin with # are left out.
  // Tokens are 1 to 512 of A-Z a-z 0-9 - . _ ~ + / =. Failures, with their line: a token that is none, or is there twice; no token at all.
  static Result<Tokens> parse(std::string_view text);
  static Result<Tokens> load(const std::filesystem::path& path);  // 1 MiB at most

  // nullptr if there is no such token. The time that it takes does not tell how much of a token was right.
  [[nodiscard]] std::shared_ptr<const Scope> find(std::string_view token) const;

 private:
  struct Entry {
    std::string token;
    std::shared_ptr<const Scope> scope;
  };
  std::vector<Entry> entries_;
};

// The token of "Authorization: Bearer TOKEN", or else of the offered subprotocol intervale.token.BASE64URL (without padding), which is all that a
// browser lets a page say. Nothing if there is none that can be read.
[[nodiscard]] std::optional<std::string> token_of(std::string_view authorization, std::string_view subprotocols);

// Whether a page of that origin may open sessions: it is among `allowed`, where * is any, or, if that is empty, has the host that the request was
// sent to. Programs send no origin, and may.
[[nodiscard]] bool is_allowed_origin(std::string_view origin, std::string_view host, std::span<const std::string> allowed);

}  // namespace intervale
