#include "proto/recipe/expression.h"

#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "worker/solver/model/errors.h"

namespace oblique::expressions {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

double value_of(const std::string& text, const std::vector<double>& values = {}) {
  return Expression(text).value_at(values);
}

std::string objection_to(const std::string& text) {
  try {
    const Expression expression(text);
  } catch (const solver::InputError& fault) {
    return fault.what();
  }
  return {};
}

TEST(ExpressionTest, ComputesWithTheUsualPrecedences) {
  EXPECT_EQ(value_of("1 + 2 * 3"), 7.0);
  EXPECT_EQ(value_of("(1 + 2) * 3"), 9.0);
  EXPECT_EQ(value_of("2 ^ 3 ^ 2"), 512.0);
  EXPECT_EQ(value_of("-2 ^ 2"), -4.0);
  EXPECT_EQ(value_of("2 ^ -2"), 0.25);
  EXPECT_EQ(value_of("8 - 3 - 2"), 3.0);
  EXPECT_EQ(value_of("2 * -3"), -6.0);
  EXPECT_EQ(value_of("1 - -1"), 2.0);
  EXPECT_EQ(value_of("+5"), 5.0);
  EXPECT_EQ(value_of("12 / 3 / 2"), 2.0);
  EXPECT_EQ(value_of("1e-3 + .5 + 2."), 2.501);
}

TEST(ExpressionTest, TheAreaMomentOfARoundSectionFollowsFromItsArea) {
  Expression expression("A^2 / (4 * pi)");
  EXPECT_THAT(expression.names(), ElementsAre("A"));
  const double A_m2 = 5.309e-4;
  const std::vector<double> values{A_m2};
  EXPECT_DOUBLE_EQ(expression.value_at(values), A_m2 * A_m2 / (4.0 * std::acos(-1.0)));
}

TEST(ExpressionTest, ComparisonsAreOneOrZeroAndBindWeakerThanSums) {
  EXPECT_EQ(value_of("mu > 0.5 * e", {0.6, 1.0}), 1.0);
  EXPECT_EQ(value_of("mu > 0.5 * e", {0.4, 1.0}), 0.0);
  EXPECT_EQ(value_of("1 < 2 && 2 < 1"), 0.0);
  EXPECT_EQ(value_of("1 < 2 || 2 < 1"), 1.0);
  EXPECT_EQ(value_of("1 == 2 or 2 == 2 and 1 != 1"), 0.0);
  EXPECT_EQ(value_of("1 == 1 or 2 == 2 and 1 != 1"), 1.0);
  EXPECT_EQ(value_of("mu > 0.3 and not e == 1", {0.4, 0.9}), 1.0);
  EXPECT_EQ(value_of("not 1 == 2 and 1 == 2"), 0.0);
  EXPECT_EQ(value_of("!1 == 2"), 1.0);
  EXPECT_EQ(value_of("not (1 >= 1)"), 0.0);
  EXPECT_EQ(value_of("if(2 <= 1, 10, 20)"), 20.0);
}

TEST(ExpressionTest, NamesAndSignsThatTouchAreToldApart) {
  EXPECT_EQ(value_of("a<-b", {1.0, -2.0}), 1.0);
  EXPECT_EQ(value_of("a--b", {1.0, 2.0}), 3.0);
  EXPECT_EQ(value_of("1!=-1"), 1.0);
  EXPECT_EQ(value_of("order", {3.0}), 3.0);
  EXPECT_EQ(value_of("e * E", {2.0, 3.0}), 6.0);
}

TEST(ExpressionTest, EveryFunctionTakesItsArgumentsAndNoOthers) {
  EXPECT_EQ(value_of("min(3, 2) + max(3, 2)"), 5.0);
  EXPECT_EQ(value_of("sqrt(2)"), std::sqrt(2.0));
  EXPECT_EQ(value_of("abs(-2) + floor(1.5) + ceil(1.5) + round(1.5)"), 7.0);
  EXPECT_EQ(value_of("log10(1000) + log2(8) + ln(1) + log(1)"), 6.0);
  for (const Function& function : functions()) {
    const std::string name(function.name);
    std::string list = "0.5";
    for (std::size_t i = 1; i < function.arguments; ++i) {
      list += ", 0.25";
    }
    EXPECT_TRUE(std::isfinite(value_of(name + "(" + list + ")"))) << name;
    EXPECT_THAT(objection_to(name + "(" + list + ", 1)"), HasSubstr("argument")) << name;
    EXPECT_THAT(objection_to(name + "()"), HasSubstr("and has 0")) << name;
    EXPECT_THAT(objection_to(name), HasSubstr("brackets"));
  }
}

TEST(ExpressionTest, WhatFollowsFromNoNumberIsNoNumberAlsoWhenCompared) {
  for (const char* text : {"sqrt(-1)", "sqrt(-1) > 0", "!sqrt(-1)", "log(-1) < 5 || 1 == 1",
                           "0 / 0 == 0", "min(1, sqrt(-1))", "if(sqrt(-1), 1, 2)"}) {
    EXPECT_TRUE(std::isnan(value_of(text))) << text;
  }
  EXPECT_TRUE(std::isinf(value_of("1 / 0")));
}

TEST(ExpressionTest, TextsThatAreNoneAreRefusedWithWhatIsWrong) {
  EXPECT_THAT(objection_to(""), HasSubstr("empty"));
  EXPECT_THAT(objection_to("e = 1"), HasSubstr("`==` compares"));
  EXPECT_THAT(objection_to("\"text\""), HasSubstr("`\"` means nothing"));
  EXPECT_THAT(objection_to("a ? b : c"), HasSubstr("`?` means nothing"));
  EXPECT_THAT(objection_to("a; b"), HasSubstr("`;`"));
  EXPECT_THAT(objection_to("0 < mu < 1"), HasSubstr("a < b && b < c"));
  EXPECT_THAT(objection_to("sqr(2)"), HasSubstr("did you mean `sqrt`?"));
  EXPECT_THAT(objection_to("2 mu"), HasSubstr("operator is missing before `mu`"));
  EXPECT_THAT(objection_to("2mu"), HasSubstr("runs into"));
  EXPECT_THAT(objection_to("1.2.3"), HasSubstr("runs into"));
  EXPECT_THAT(objection_to("1e999"), HasSubstr("cannot be read"));
  EXPECT_THAT(objection_to("(1 + 2"), HasSubstr("open"));
  EXPECT_THAT(objection_to("1 + 2)"), HasSubstr("closing"));
  EXPECT_THAT(objection_to("1, 2"), HasSubstr("list of values"));
  EXPECT_THAT(objection_to("\xce\xbc > 1"), HasSubstr("means nothing"));
  EXPECT_THAT(objection_to("1 +"), HasSubstr("a value is missing at its end"));
  EXPECT_THAT(objection_to("1 + * 2"), HasSubstr("a value is missing before `*`"));
  EXPECT_THAT(objection_to("1 < or 2"), HasSubstr("a value is missing before `or`"));
  EXPECT_THAT(objection_to("1 + not e"), HasSubstr("needs brackets"));
  EXPECT_THAT(objection_to("(1, 2)"), HasSubstr("arguments of a function"));
  for (const char* text : {"* 2", "()", "min(,)", "min(1,)", "sqrt(1 2)", ",", "(1)(2)", "!",
                           "1 ! 2", "1 not 2", "e pi", "0 < mu == 1", "1e", "0x10", "a & b"}) {
    EXPECT_NE(objection_to(text), "") << text;
  }
}

TEST(ExpressionTest, LongAndDeepTextsAreRefused) {
  EXPECT_THAT(objection_to(std::string(kLongestText + 1, '1')), HasSubstr("more than 1000"));
  const std::string deep =
      std::string(kDeepestNesting, '(') + "1" + std::string(kDeepestNesting, ')');
  EXPECT_EQ(objection_to(deep), "");
  EXPECT_THAT(objection_to("(" + deep + ")"), HasSubstr("deep"));
  std::string chain = "1";
  while (chain.size() + 2 <= kLongestText) {
    chain += "^1";
  }
  EXPECT_EQ(value_of(chain), 1.0);
  EXPECT_NE(objection_to(std::string(kLongestText - 1, '-') + "1"), "");
}

}  // namespace
}  // namespace oblique::expressions
