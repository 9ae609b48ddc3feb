// How many random cases a property is tried on.
#pragma once

#include <gtest/gtest.h>

namespace intervale::testing {

// The parameters of a property: `count` seeds from `first` on. Under the address sanitizer a third of them: a case takes
// several times as long there, and other builds try them all.
inline auto seeds(unsigned first, unsigned count) {
#ifdef __SANITIZE_ADDRESS__
  count = (count + 2) / 3;
#endif
  return ::testing::Range(first, first + count);
}

}  // namespace intervale::testing
