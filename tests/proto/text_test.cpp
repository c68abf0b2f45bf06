#include "proto/text.h"

#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace oblique::protocol {
namespace {

using namespace std::string_literals;

TEST(VisibleText, EscapesTextThatControlsATerminalForgesALineOrIsInvisible) {
  for (const auto& [text, shown] : std::vector<std::pair<std::string, std::string>>{
           {"\x1b[2Jx", "\\x1b[2Jx"},
           {"a\0b"s, "a\\x00b"},
           {"one\ntwo\r\tthree\a\b\x7f", "one\\ntwo\\r\\tthree\\x07\\x08\\x7f"},
           {"\u0080\u0085\u009b2J", "\\u0080\\u0085\\u009b2J"},
           {"a\u202eb\u2066c\u2069", "a\\u202eb\\u2066c\\u2069"},
           {"a\ufffe\uffff", "a\\ufffe\\uffff"},
           {"\u200e\u200f\u061c\u2028\u2029", "\\u200e\\u200f\\u061c\\u2028\\u2029"},
           {"\u00ad\u200b\u200c\u2060\ufeff", "\\u00ad\\u200b\\u200c\\u2060\\ufeff"},
           {"\ufe0f\U000e0041", "\\ufe0f\\ue0041"},
           // Not UTF-8: bytes that never occur, a truncated and an overlong character, half a
           // surrogate pair, a code point beyond U+10FFFF.
           {"a\xff\xfe", "a\\xff\\xfe"},
           {"\xe2\x80", "\\xe2\\x80"},
           {"\xc0\x9b", "\\xc0\\x9b"},
           {"\xe0\x82\x9b", "\\xe0\\x82\\x9b"},
           {"\xed\xa0\x80", "\\xed\\xa0\\x80"},
           {"\xf4\x90\x80\x80", "\\xf4\\x90\\x80\\x80"},
           {"\xc3\x28", "\\xc3("}}) {
    EXPECT_EQ(visible(text), shown);
    EXPECT_FALSE(is_visible(text)) << shown;
  }
  EXPECT_EQ(visible_lines("one\ntwo\x1b\r\n"), "one\ntwo\\x1b\\r\n") << "line breaks are kept";
}

TEST(VisibleText, LeavesOtherTextUnchanged) {
  for (const char* text : {"", "plain", "μ > 0.5, Größe, 参数, 🙂",
                           "\u00a0\u2027\u202f\u2070", "back\\slash \\x1b", "\U0010ffff"}) {
    EXPECT_EQ(visible(text), text);
    EXPECT_TRUE(is_visible(text) && is_utf8(text)) << text;
  }
  EXPECT_FALSE(is_utf8("a\xc3") || is_utf8("\xed\xa0\x80"));
}

TEST(Excerpt, HasWholeCharactersWithinTheLimit) {
  EXPECT_EQ(excerpt("four", 4), "four");
  EXPECT_EQ(excerpt("fivex", 4), "five...");
  EXPECT_EQ(excerpt("a\x1b[2J", 4), "a\\x1...");
  EXPECT_EQ(excerpt("\u03bc\u03bc", 3), "\u03bc...");
  EXPECT_EQ(shortened("a\xc3\xa9", 2), "a");
  EXPECT_EQ(shortened("a\xc3\xa9", 3), "a\xc3\xa9");
}

constexpr std::array<std::string_view, 5> kNames{"mu", "e", "H", "tip_mass", "elements_per_link"};

TEST(Suggestion, FindsTheNameNearestToAMistypedWord) {
  for (const auto& [word, name] : std::vector<std::pair<std::string_view, std::string_view>>{
           {"tip_mas", "tip_mass"},
           {"elements-per-link", "elements_per_link"},
           {"MU", "mu"},
           {"restitution", ""},
           {"z", ""}}) {
    EXPECT_EQ(nearest(word, kNames), name);
  }
  EXPECT_EQ(did_you_mean("zz", kNames), "");
  EXPECT_EQ(did_you_mean("muu", kNames), " (did you mean `mu`?)");
  EXPECT_EQ(joined(kNames), "mu, e, H, tip_mass, elements_per_link");
  EXPECT_EQ(unknown_key(std::string(10'000'000, 'k'), kNames),
            "unknown key `" + std::string(80, 'k') + "...`");
}

}  // namespace
}  // namespace oblique::protocol
