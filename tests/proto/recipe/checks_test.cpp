#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/axes.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/checks.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "tests/support/recipes.h"

namespace oblique::protocol {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// What the study is refused with; empty when it is taken.
std::string refusal(const Recipe& recipe) {
  try {
    const PointTable table(recipe);
    return "";
  } catch (const solver::InputError& error) {
    return error.what();
  }
}

/// The refusal of a block whose axis of mu is replaced.
std::string refusal_of_mu(const Axis& mu) {
  return refusal(recipe_of({{listed("H", {1.0}), mu, listed("e", {1.0})}}));
}

std::string refusal_with_model_axis(const Axis& axis) {
  return refusal(recipe_of({{axis, listed("H", {1.0}), listed("mu", {0.4}), listed("e", {1.0})}}));
}

TEST(RecipeRules, AGoodStudyIsTaken) {
  EXPECT_EQ(refusal_of_mu(listed("mu", {0.4})), "");
  EXPECT_EQ(refusal_of_mu(range("mu", 0.4, 0.4, 1)), "");
  EXPECT_EQ(refusal_with_model_axis(range("links", 3, 6, 4)), "");
}

TEST(RecipeRules, AStudyWithoutBlocksIsRefused) {
  EXPECT_THAT(refusal(recipe_of({})), HasSubstr("no block"));
}

TEST(RecipeRules, AnUnknownKeyIsNamedAndTheKnownOnesListed) {
  EXPECT_THAT(refusal_with_model_axis(listed("wobble", {1.0})),
              AllOf(HasSubstr("`wobble`"), HasSubstr("elements_per_link"), HasSubstr("mu")));
}

TEST(RecipeRules, AKeyOfUnreasonableLengthIsNotRepeatedInTheMessage) {
  EXPECT_LT(refusal_with_model_axis(listed(std::string(100'000, 'x'), {1.0})).size(), 500U);
}

TEST(RecipeRules, AKeyGivenTwiceIsRefused) {
  EXPECT_THAT(refusal(recipe_of({{listed("H", {1.0}), listed("mu", {0.4}), listed("mu", {0.5}),
                                  listed("e", {1.0})}})),
              HasSubstr("mu appears twice"));
}

TEST(RecipeRules, AMissingPointKeyIsNamed) {
  EXPECT_THAT(refusal(recipe_of({{listed("mu", {0.4}), listed("e", {1.0})}})),
              HasSubstr("H is missing"));
  EXPECT_THAT(refusal(recipe_of({{listed("H", {1.0}), listed("e", {1.0})}})),
              HasSubstr("mu is missing"));
  EXPECT_THAT(refusal(recipe_of({{listed("H", {1.0}), listed("mu", {0.4})}})),
              HasSubstr("e is missing"));
  EXPECT_THAT(refusal(recipe_of({{}})), HasSubstr("H is missing"));
}

TEST(RecipeRules, AxesOutOfOrderAreRefused) {
  EXPECT_THAT(refusal(recipe_of({{listed("mu", {0.4}), listed("H", {1.0}), listed("e", {1.0})}})),
              HasSubstr("out of order"));
  EXPECT_THAT(refusal(recipe_of({{listed("H", {1.0}), listed("mu", {0.4}), listed("e", {1.0}),
                                  listed("k", {1e7})}})),
              HasSubstr("out of order"));
}

TEST(RecipeRules, AnAxisWithoutValuesIsRefused) {
  EXPECT_THAT(refusal_of_mu(listed("mu", {})), HasSubstr("mu = [] has no values"));
}

TEST(RecipeRules, AnAxisWithValuesAndARangeIsRefused) {
  Axis both = range("mu", 0.1, 0.2, 2);
  both.add_values(0.4);
  EXPECT_THAT(refusal_of_mu(both), HasSubstr("both listed values and a range"));
}

TEST(RecipeRules, AReversedRangeIsRefusedWithItsEnds) {
  EXPECT_THAT(refusal_of_mu(range("mu", 2.0, 0.5, 4)),
              AllOf(HasSubstr("from 2 to 0.5"), HasSubstr("reversed")));
}

TEST(RecipeRules, ARangeNeedsACountThatFitsItsEnds) {
  EXPECT_THAT(refusal_of_mu(range("mu", 0.5, 2.0, 1)), HasSubstr("holds both ends"));
  EXPECT_THAT(refusal_of_mu(range("mu", 0.5, 0.5, 7)),
              AllOf(HasSubstr("count = 7"), HasSubstr("equal ends, 0.5")));
}

TEST(RecipeRules, ValuesThatAreNotFiniteAreRefused) {
  EXPECT_THAT(refusal_of_mu(listed("mu", {kNan})), HasSubstr("mu = nan"));
  EXPECT_THAT(refusal_of_mu(listed("mu", {kInfinity})), HasSubstr("mu = inf"));
  EXPECT_THAT(refusal_of_mu(range("mu", 0.0, kInfinity, 3)), HasSubstr("mu = inf"));
  EXPECT_THAT(refusal_of_mu(range("mu", kNan, 1.0, 3)), HasSubstr("mu = nan"));
}

TEST(RecipeRules, ValuesOutOfTheirDomainAreNamedWithWhatIsAllowed) {
  EXPECT_THAT(refusal_of_mu(listed("mu", {0.4, -0.1})),
              AllOf(HasSubstr("mu = -0.1"), HasSubstr(">= 0")));
  EXPECT_THAT(
      refusal(recipe_of({{listed("H", {1.0}), listed("mu", {0.4}), range("e", 0.0, 1.0, 3)}})),
      AllOf(HasSubstr("e = 0"), HasSubstr("[0.001, 1]")));
  EXPECT_THAT(refusal(recipe_of({{listed("H", {-1.0}), listed("mu", {0.4}), listed("e", {1.0})}})),
              HasSubstr("H = -1"));
  EXPECT_THAT(refusal_with_model_axis(listed("k", {0.0})), HasSubstr("k = 0"));
}

TEST(RecipeRules, AValueThatIsListedTwiceIsRefusedWhereverItStands) {
  for (const std::vector<double>& values :
       {std::vector{0.4, 0.4}, {0.4, 0.5, 0.4}, {0.5, 0.4, 0.3, 0.4}, {0.0, 1.0, -0.0}}) {
    EXPECT_THAT(refusal_of_mu(listed("mu", values)), HasSubstr("twice"));
  }
  EXPECT_THAT(refusal_of_mu(listed("mu", {0.5, 0.4, 0.6})), "");
}

TEST(RecipeRules, ARecipeThatNoWorkerCanBeSentIsRefused) {
  Recipe recipe = recipe_of({{listed("mu", {})}});
  recipe.mutable_blocks(0)->mutable_axes(0)->mutable_values()->Resize(1 << 20, 0.5);
  EXPECT_NO_THROW(check_size(recipe));
  recipe.mutable_blocks(0)->mutable_axes(0)->mutable_values()->Resize(1 << 21, 0.5);
  EXPECT_THROW(check_size(recipe), solver::InputError);
}

TEST(RecipeRules, ARangeOfWholeNumbersThatHoldsFractionsIsRefused) {
  EXPECT_EQ(refusal_with_model_axis(range("elements_per_link", 2, 8, 4)), "");
  EXPECT_THAT(refusal_with_model_axis(range("elements_per_link", 2, 8, 5)),
              HasSubstr("elements_per_link = 3.5"));
  EXPECT_THAT(refusal_with_model_axis(range("elements_per_link", 1, 256, 1'000'000'000)),
              HasSubstr("elements_per_link = 1.0000002"));
}

TEST(RecipeRules, ARangeIsRefusedExactlyWhenOneOfItsValuesIs) {
  const solver::ParameterKey& key = *solver::find_model_key("elements_per_link");
  for (const double from : {1.0, 2.0, 7.0}) {
    for (const double to : {8.0, 13.0, 256.0}) {
      for (std::uint64_t count = 2; count <= 520; ++count) {
        const Axis axis = range("elements_per_link", from, to, count);
        bool all_allowed = true;
        for (std::uint64_t i = 0; i < count; ++i) {
          all_allowed = all_allowed && key.is_allowed(axis_value(axis, i));
        }
        EXPECT_EQ(refusal_with_model_axis(axis).empty(), all_allowed)
            << from << ":" << to << ":" << count;
      }
    }
  }
}

TEST(RecipeRules, AnHBeyondTheShortestChainOfTheBlockIsRefused) {
  EXPECT_THAT(
      refusal(recipe_of({{range("H", 0.9, 1.3, 5), listed("mu", {0.4}), listed("e", {1.0})}})),
      AllOf(HasSubstr("H = 1.3"), HasSubstr("1.2 m")));
  EXPECT_THAT(refusal_with_model_axis(listed("length", {0.4, 0.3})),
              AllOf(HasSubstr("H = 1"), HasSubstr("0.9 m")));
  EXPECT_THAT(refusal_with_model_axis(range("links", 2, 4, 3)), HasSubstr("0.8 m"));
}

TEST(RecipeRules, MoreThanATrillionPointsAreRefusedWithoutOverflow) {
  const std::uint64_t huge = std::numeric_limits<std::uint64_t>::max();
  EXPECT_THAT(refusal_of_mu(range("mu", 0.0, 1.0, huge)), HasSubstr("more than 1000000000000"));
  // 2^32 · 2^32 would wrap to 0.
  const std::uint64_t half = std::uint64_t{1} << 32U;
  EXPECT_THAT(
      refusal(recipe_of({{listed("H", {1.0}), range("mu", 0, 1, half), range("e", 0.5, 1, half)}})),
      HasSubstr("more than 1000000000000"));
  const std::vector<Axis> most{listed("H", {1.0}), range("mu", 0, 1, 1'000'000),
                               range("e", 0.5, 1, 1'000'000)};
  EXPECT_EQ(refusal(recipe_of({most})), "");
  EXPECT_THAT(refusal(recipe_of({most, most})), HasSubstr("more than 1000000000000"));
}

TEST(RecipeRules, TheBlockIsNamedWhenThereAreSeveral) {
  const std::vector<Axis> good{listed("H", {1.0}), listed("mu", {0.4}), listed("e", {1.0})};
  const std::vector<Axis> bad{listed("H", {1.0}), listed("mu", {-1}), listed("e", {1.0})};
  EXPECT_THAT(refusal(recipe_of({good, bad})), StartsWith("block 2: mu = -1"));
}

TEST(RecipeRules, AModelOutsideItsDomainIsRefused) {
  Recipe recipe = recipe_of({{listed("H", {1.0}), listed("mu", {0.4}), listed("e", {1.0})}});
  solver::ModelParameters model = solver::preset("paper");
  model.E_Pa = -1.0;
  *recipe.mutable_model() = to_message(model);
  EXPECT_THAT(refusal(recipe), HasSubstr("E = -1"));
}

}  // namespace
}  // namespace oblique::protocol
