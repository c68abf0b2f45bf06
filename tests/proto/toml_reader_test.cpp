#include "proto/toml_reader.h"

#include <cmath>
#include <functional>
#include <string>

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

TEST(TomlReader, ErrorsHaveThePlaceOfInvalidToml) {
  EXPECT_THAT(parse_error("x = 1\ny =\n"), StartsWith("a.toml:2:"));
  EXPECT_THAT(parse_error("x = \"a\n"), StartsWith("a.toml:1:"));
}

TEST(TomlReader, RefusesKeysThatNestDeeply) {
  std::string deep = "a";
  for (int i = 0; i < 100; ++i) {
    deep += ".a";
  }
  for (const std::string& text : {deep + " = 1\n", "[" + deep + "]\n", "{ " + deep + " = 1 }\n"}) {
    EXPECT_THAT(parse_error("x = 1\n" + text), StartsWith("a.toml:2: more than 100 parts"));
  }
  EXPECT_EQ(parse_error(deep.substr(2) + " = '" + deep.substr(2) + "'\n"), "nothing was thrown");
  std::string numbers = "x = [0.5";
  for (int i = 0; i < 200; ++i) {
    numbers += ", 0.5";
  }
  EXPECT_EQ(parse_error(numbers + "]\n"), "nothing was thrown");
}

TEST(TomlReader, ANumberThatADoubleCannotHoldIsRefused) {
  for (const char* text : {"x = 1e-400\n", "x = [1, -1e-400]\n", "x = { y = +1.5E400 }\n",
                           "x = 1 # it's\ny = 1e-400"}) {
    EXPECT_THAT(parse_error(text + std::string("\n")), HasSubstr("is not a number: it is too"));
  }
  EXPECT_EQ(parse_error("x = '1e-400' # 1e-400\ny = 1e-300\nz = \"1e-400\"\n"),
            "nothing was thrown");
}

TEST(TomlReader, AZeroHasNoSign) {
  const auto top = reader().parse("x = -0.0\n");
  EXPECT_FALSE(std::signbit(reader().number("x", *top.get("x"), "a number")));
}

TEST(TomlReader, ErrorsNameTheKindOfAValueAndTheExpectedOne) {
  const auto top = reader().parse("x = \"text\"\ny = [1, 2.5]\n");
  EXPECT_EQ(error_of([&] { (void)reader().number("x", *top.get("x"), "a number"); }),
            "a.toml:1:5: x = 'text' is a string: it must be a number");
  EXPECT_EQ(error_of([&] { (void)reader().boolean("y", *top.get("y")); }),
            "a.toml:2:5: y = [1, 2.5] is a list: it must be true or false");
}

}  // namespace
}  // namespace oblique::protocol
