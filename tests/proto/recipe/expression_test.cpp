#include "proto/recipe/expression.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "worker/solver/model/errors.h"

namespace oblique::expressions {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// Parses an expression. Appends each of its names once to `names`, in the order of the text.
Expression read(const std::string& text, std::vector<std::string>& names) {
  return Expression(text, [&](std::string_view name) {
    const auto found = std::find(names.begin(), names.end(), name);
    const auto place = static_cast<std::size_t>(found - names.begin());
    if (found == names.end()) {
      names.emplace_back(name);
    }
    return place;
  });
}

double value_of(const std::string& text, const std::vector<double>& values = {}) {
  std::vector<std::string> names;
  return read(text, names).value_at(values);
}

std::string error_for(const std::string& text) {
  std::vector<std::string> names;
  try {
    read(text, names);
  } catch (const solver::InputError& fault) {
    return fault.what();
  }
  return {};
}

TEST(ExpressionTest, ComputesWithTheUsualPrecedences) {
  for (const auto& [text, value] :
       std::vector<std::pair<std::string, double>>{{"1 + 2 * 3", 7.0},
                                                   {"(1 + 2) * 3", 9.0},
                                                   {"2 ^ 3 ^ 2", 512.0},
                                                   {"-2 ^ 2", -4.0},
                                                   {"2 ^ -2", 0.25},
                                                   {"8 - 3 - 2", 3.0},
                                                   {"2 * -3", -6.0},
                                                   {"1 - -1", 2.0},
                                                   {"+5", 5.0},
                                                   {"12 / 3 / 2", 2.0},
                                                   {"1e-3 + .5 + 2.", 2.501},
                                                   {"1 < 2 && 2 < 1", 0.0},
                                                   {"1 < 2 || 2 < 1", 1.0},
                                                   {"1 == 2 or 2 == 2 and 1 != 1", 0.0},
                                                   {"1 == 1 or 2 == 2 and 1 != 1", 1.0},
                                                   {"not 1 == 2 and 1 == 2", 0.0},
                                                   {"!1 == 2", 1.0},
                                                   {"not (1 >= 1)", 0.0},
                                                   {"2 * (not 1 == 2)", 2.0},
                                                   {"if(2 <= 1, 10, 20)", 20.0},
                                                   {"1!=-1", 1.0},
                                                   {"NOT 1 == 2 AND 1 < 2 Or 1 > 2", 1.0},
                                                   {"pow(2, 3)", 8.0}}) {
    EXPECT_EQ(value_of(text), value) << text;
  }
}

TEST(ExpressionTest, NamesTakeTheirValuesInTheOrderOfTheText) {
  std::vector<std::string> names;
  const Expression expression = read("A^2 / (4 * pi) + e * A", names);
  EXPECT_THAT(names, ElementsAre("A", "e"));
  EXPECT_DOUBLE_EQ(expression.value_at(std::vector{3.0, 2.0}), 9.0 / (4.0 * std::acos(-1.0)) + 6.0);
  EXPECT_EQ(value_of("mu > 0.5 * e", {0.6, 1.0}), 1.0);
  EXPECT_EQ(value_of("mu > 0.3 and not e == 1", {0.4, 0.9}), 1.0);
  EXPECT_EQ(value_of("a<-b", {1.0, -2.0}), 1.0);
  EXPECT_EQ(value_of("a--b", {1.0, 2.0}), 3.0);
  EXPECT_EQ(value_of("order", {3.0}), 3.0);
  EXPECT_EQ(value_of("e * E", {2.0, 3.0}), 6.0);
}

TEST(ExpressionTest, EveryFunctionTakesItsArgumentsAndNoOthers) {
  EXPECT_EQ(value_of("min(3, 2) + max(3, 2) + if(1, 2, 3)"), 7.0);
  EXPECT_EQ(value_of("abs(-2) + floor(1.5) + ceil(1.5) + round(1.5)"), 7.0);
  EXPECT_EQ(value_of("sqrt(4) + log10(1000) + log2(8) + ln(1) + log(1)"), 8.0);
  for (const Function& each : functions()) {
    const std::string name(each.name);
    EXPECT_THAT(error_for(name + "()"), HasSubstr("and has 0"));
    EXPECT_THAT(error_for(name + "(1, 2, 3, 4)"), HasSubstr("and has 4"));
    EXPECT_THAT(error_for(name), HasSubstr("brackets"));
  }
}

TEST(ExpressionTest, NanStaysNanAlsoInComparisons) {
  for (const char* text : {"sqrt(-1)", "sqrt(-1) > 0", "!sqrt(-1)", "log(-1) < 5 || 1 == 1",
                           "0 / 0 == 0", "min(1, sqrt(-1))", "if(sqrt(-1), 1, 2)"}) {
    EXPECT_TRUE(std::isnan(value_of(text))) << text;
  }
  EXPECT_TRUE(std::isnan(value_of("1 / 0"))) << "a division by zero is undefined";
}

TEST(ExpressionTest, AnInvalidTextIsRefusedWithTheReason) {
  for (const auto& [text, reason] : std::vector<std::pair<std::string, std::string>>{
           {"", "empty"},
           {"e = 1", "use `==` to compare"},
           {"\"text\"", "a value is missing before `\"`"},
           {"a ? b : c", "`?` is not an operator"},
           {"a; b", "`;`"},
           {"0 < mu < 1", "a < b && b < c"},
           {"0 < mu == 1", "a < b && b < c"},
           {"sqr(2)", "did you mean `sqrt`?"},
           {"2 mu", "operator is missing before `mu`"},
           {"(1)(2)", "operator is missing before `(`"},
           {"2 * not mu == 0.2", "needs brackets"},
           {"-not mu", "needs brackets"},
           {"1 not 2", "operator is missing before `not`"},
           {"2mu", "missing after a number"},
           {"1.2.3", "missing after a number"},
           {"1e", "missing after a number"},
           {"0x10", "missing after a number"},
           {"1e999", "invalid number"},
           {"(1 + 2", "is not closed"},
           {"1 + 2)", "closing"},
           {"1, 2", "arguments of a function"},
           {"(1, 2)", "arguments of a function"},
           {"\xce\xbc > 1", "a value is missing before `\xce\xbc`"},
           {"a & b", "an operator is missing before `&`"},
           {"1 +", "a value is missing at its end"},
           {"!", "a value is missing at its end"},
           {"1 + * 2", "a value is missing before `*`"},
           {"1 < or 2", "a value is missing before `or`"},
           {"()", "a value is missing before `)`"},
           {"min(1,)", "a value is missing before `)`"},
           {std::string(kLongestText + 1, '1'), "at most 1000"}}) {
    EXPECT_THAT(error_for(text), HasSubstr(reason)) << text;
  }
}

TEST(ExpressionTest, TheLongestTextsAreComputedHoweverTheyNest) {
  const std::string brackets = std::string(499, '(') + "1" + std::string(499, ')');
  EXPECT_EQ(value_of(brackets), 1.0);
  EXPECT_EQ(value_of(std::string(kLongestText - 2, '-') + "1"), 1.0);
  std::string chain = "1";
  while (chain.size() + 2 <= kLongestText) {
    chain += "^1";
  }
  EXPECT_EQ(value_of(chain), 1.0);
}

}  // namespace
}  // namespace oblique::expressions
