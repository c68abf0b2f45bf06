#include "proto/text.h"

#include <string>

#include <gtest/gtest.h>

namespace oblique::protocol {
namespace {

using namespace std::string_literals;

TEST(VisibleText, WritesOutWhatSteersATerminal) {
  EXPECT_EQ(visible("\x1b[2Jx"), "\\x1b[2Jx");
  EXPECT_EQ(visible("a\0b"s), "a\\x00b");
  EXPECT_EQ(visible("one\ntwo\r\tthree\a\b\x7f"), "one\\ntwo\\r\\tthree\\x07\\x08\\x7f");
  EXPECT_EQ(visible("\u009b2J"), "\\u009b2J");
  EXPECT_EQ(visible("\u0080\u0085\u009f"), "\\u0080\\u0085\\u009f");
}

TEST(VisibleText, WritesOutWhatTurnsTheDirectionOrEndsALine) {
  EXPECT_EQ(visible("a\u202eb\u2066c\u2069"), "a\\u202eb\\u2066c\\u2069");
  EXPECT_EQ(visible("a\ufffe\uffff"), "a\\ufffe\\uffff");
  EXPECT_EQ(visible("\u200e\u200f\u061c\u2028\u2029"), "\\u200e\\u200f\\u061c\\u2028\\u2029");
}

TEST(VisibleText, WritesOutWhatHasNoWidth) {
  EXPECT_EQ(visible("\u00ad\u200b\u200c\u200d\u2060\ufeff"),
            "\\u00ad\\u200b\\u200c\\u200d\\u2060\\ufeff");
  EXPECT_EQ(visible("\ufe0f\U000e0041"), "\\ufe0f\\ue0041");
}

TEST(VisibleText, LeavesAllOtherTextAlone) {
  for (const char* text : {"", "plain", "μ > 0.5, Größe, 参数, 🙂",
                           "\u00a0\u2027\u202f\u2070", "back\\slash \\x1b", "\U0010ffff"}) {
    EXPECT_EQ(visible(text), text);
    EXPECT_TRUE(is_visible(text)) << text;
  }
}

TEST(Excerpt, HasAtMostSoManyBytesOfWhatIsShown) {
  EXPECT_EQ(excerpt("four", 4), "four");
  EXPECT_EQ(excerpt("fivex", 4), "five...");
  EXPECT_EQ(excerpt("a\x1b[2J", 4), "a\\x1...");
  EXPECT_EQ(excerpt("\u03bc\u03bc", 3), "\u03bc...") << "no half of a character";
}

TEST(VisibleText, WritesOutBytesThatAreNotUtf8) {
  EXPECT_EQ(visible("a\xff\xfe"), "a\\xff\\xfe");
  EXPECT_EQ(visible("\x9b"), "\\x9b");                    // a C1 control on an 8-bit terminal
  EXPECT_EQ(visible("\xc2"), "\\xc2");                    // cut off
  EXPECT_EQ(visible("\xe2\x80"), "\\xe2\\x80");           // cut off
  EXPECT_EQ(visible("\xc0\x9b"), "\\xc0\\x9b");           // longer than need be
  EXPECT_EQ(visible("\xe0\x82\x9b"), "\\xe0\\x82\\x9b");  // likewise
  EXPECT_EQ(visible("\xed\xa0\x80"), "\\xed\\xa0\\x80");  // half a pair of UTF-16
  EXPECT_EQ(visible("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");  // above U+10FFFF
  EXPECT_EQ(visible("\xc3\x28"), "\\xc3(");                        // the byte after is itself
  EXPECT_FALSE(is_visible("\xff"));
}

TEST(VisibleText, KeepsLineBreaksWhereTheyAreWanted) {
  EXPECT_EQ(visible_lines("one\ntwo\x1b\r\n"), "one\ntwo\\x1b\\r\n");
}

TEST(ShortenedText, KeepsWholeCharacters) {
  EXPECT_EQ(shortened("a\xc3\xa9", 2), "a");
  EXPECT_EQ(shortened("a\xc3\xa9", 3), "a\xc3\xa9");
}

TEST(Utf8, IsToldFromOtherBytes) {
  EXPECT_TRUE(is_utf8("a\xc3\xa9"));
  EXPECT_FALSE(is_utf8("a\xc3"));
  EXPECT_FALSE(is_utf8("\xed\xa0\x80"));
}

}  // namespace
}  // namespace oblique::protocol
