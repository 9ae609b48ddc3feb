// How many random cases a property is tried on.
#pragma once

#include <gtest/gtest.h>

namespace intervale::testing {

// How many of `count` cases are tried. Under the address sanitizer a third of them: a case takes several times as long
// there, and other builds try them all.
constexpr unsigned cases(unsigned count) {
#ifdef __SANITIZE_ADDRESS__
  return (count + 2) / 3;
#else
  return count;
#endif
}

// The parameters of a property: seeds from `first` on, cases(count) of them.
inline auto seeds(unsigned first, unsigned count) { return ::testing::Range(first, first + cases(count)); }

}  // namespace intervale::testing
