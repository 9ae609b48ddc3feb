// The result of a function that can fail because of its input or environment: a value, or one line of text.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace intervale {

struct Error {
  std::string message;  // one line without a full stop: what is wrong, where, and how to correct it
  bool usage = false;   // wrong usage (exit status 2), not a failure (1)
};

template <class T>
using Result = tl::expected<T, Error>;

// The failure of a function that returns a Result: `return fail("...");`
[[nodiscard]] inline tl::unexpected<Error> fail(std::string message) { return tl::unexpected<Error>(Error{std::move(message), false}); }
[[nodiscard]] inline tl::unexpected<Error> misuse(std::string message) { return tl::unexpected<Error>(Error{std::move(message), true}); }

}  // namespace intervale
