#include "proto/toml_reader.h"

#include <array>
#include <functional>
#include <string>
#include <string_view>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace oblique::protocol {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

TomlReader reader() {
  return TomlReader("a.toml");
}

std::string error_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const solver::InputError& error) {
    return error.what();
  }
  return "nothing was thrown";
}

std::string parse_error(const std::string& text) {
  return error_of([&] { (void)reader().parse(text); });
}

TEST(TomlReader, NamesThePlaceOfTextThatIsNoToml) {
  EXPECT_THAT(parse_error("x = 1\ny =\n"), StartsWith("a.toml:2:"));
  EXPECT_THAT(parse_error("x = \"a\n"), StartsWith("a.toml:1:"));
}

TEST(TomlReader, RefusesKeysThatNestDeeply) {
  const std::string deep = "a.b.c.d.e.f.g.h.i";
  EXPECT_THAT(parse_error("x = 1\n " + deep + " = 1\n"),
              StartsWith("a.toml:2:2: a key has more than 8 parts"));
  EXPECT_THAT(parse_error("[" + deep + "]\n"), StartsWith("a.toml:1:2: a key has more"));
  EXPECT_THAT(parse_error("x = { " + deep + " = 1 }\n"), HasSubstr("a key has more"));
  EXPECT_THAT(parse_error("\"#\".'='.\"\\\".\".d.e.f.g.h.i = 1\n"), HasSubstr("a key has more"));
}

TEST(TomlReader, DotsInTextCommentsAndNumbersAreNoPartsOfKeys) {
  const std::string dots = "a.b.c.d.e.f.g.h.i.j";
  EXPECT_EQ(parse_error("# " + dots + "\nx = \"" + dots + "\"\ny = '''\n" + dots +
                        "\n'''\nz = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]\n" +
                        dots.substr(0, 15) + " = 1\n"),
            "nothing was thrown");
}

TEST(TomlReader, SaysWhatAValueIsAndMustBe) {
  const auto top = reader().parse("x = \"text\"\ny = [1, 2.5]\n");
  EXPECT_EQ(error_of([&] { (void)reader().number("x", *top.get("x"), "a number"); }),
            "a.toml:1:5: x = 'text' is a string: it must be a number");
  EXPECT_EQ(error_of([&] { (void)reader().yes("y", *top.get("y")); }),
            "a.toml:2:5: y = [1, 2.5] is a list: it must be true or false");
}

TEST(TomlReader, NamesTheKeyThatAnUnknownOneMayMean) {
  constexpr std::array<std::string_view, 2> kKnown{"count", "seed"};
  const auto top = reader().parse("count = 1\n\nsed = 2\n");
  EXPECT_EQ(error_of([&] { reader().refuse_unknown(top, kKnown, "sample: ", "give count"); }),
            "a.toml:3:1: sample: unknown key `sed` (did you mean `seed`?): give count");
}

}  // namespace
}  // namespace oblique::protocol
