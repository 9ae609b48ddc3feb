// What a function gives back that can fail through no fault of the program: a value, or one line that says what, where, and the mend.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace intervale {

struct Error {
  std::string message;  // one line, no full stop at its end: what is wrong, where, and what would mend it
  bool usage = false;   // the caller asked for something that makes no sense (exit status 2), rather than something that failed (1)
};

template <class T>
using Result = tl::expected<T, Error>;

// The failure of a function that returns a Result: `return fail("...");`
[[nodiscard]] inline tl::unexpected<Error> fail(std::string message) { return tl::unexpected<Error>(Error{std::move(message), false}); }
[[nodiscard]] inline tl::unexpected<Error> misuse(std::string message) { return tl::unexpected<Error>(Error{std::move(message), true}); }

}  // namespace intervale
