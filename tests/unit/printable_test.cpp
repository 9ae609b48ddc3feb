#include "common/util/printable.h"

#include <gtest/gtest.h>

#include <string>

namespace intervale {
namespace {

TEST(Printable, TextHasNoControlCharacters) {
  EXPECT_EQ(printable(""), "");
  EXPECT_EQ(printable("engine 5 \xc3\xa9 \xe2\x82\xac"), "engine 5 \xc3\xa9 \xe2\x82\xac");
  EXPECT_EQ(printable(std::string("a\0\n\r\t\x1b[31m\x7f", 11)), "a?????[31m?");
  EXPECT_EQ(printable("\xc2\x80|\xc2\x9b|\xc2\x9f|\xc2\xa0|\xc2"), "?|?|?|\xc2\xa0|\xc2");
  EXPECT_EQ(printable("\xc3\x9b"), "\xc3\x9b") << "a letter that ends in the same byte";
}

}  // namespace
}  // namespace intervale
