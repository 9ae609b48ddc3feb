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

TEST(Printable, NothingHiddenChangesHowTextIsRead) {
  for (const char* hidden :
       {"\u061c", "\u200b", "\u200e", "\u200f", "\u2028", "\u2029", "\u202a", "\u202e", "\u2060", "\u2066", "\u2069", "\u206f", "\ufeff"}) {
    EXPECT_EQ(printable(std::string("a") + hidden + "b"), "a?b") << hidden;
    const std::string half = std::string(hidden).substr(0, std::string(hidden).size() - 1);
    EXPECT_EQ(printable(half), half);
  }
  for (const char* seen : {"\u061b", "\u200a", "\u200c", "\u200d", "\u2010", "\u2027", "\u202f", "\u205f", "\u2070", "\u20ac", "\ufefe", "\uff01"})
    EXPECT_EQ(printable(seen), seen);
}

TEST(Printable, OnlyControlCharactersAreNoPartOfNames) {
  for (const char* name : {"", "a\u202eb", "\ufeff", "\u00a0", "\xc2"}) EXPECT_FALSE(has_control_characters(name));
  for (const char* name : {"a\nb", "\x7f", "a\u0080", "\u009f"}) EXPECT_TRUE(has_control_characters(name));
}

}  // namespace
}  // namespace intervale
