#include "server/study/recipe_growth.h"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/model_message.h"
#include "tests/support/recipes.h"

namespace oblique::server {
namespace {

using protocol::listed;
using protocol::range;
using testing::HasSubstr;
using testing::Not;

std::vector<protocol::Axis> axes_with(const protocol::Axis& mu) {
  return {listed("H", {1.0}), mu, listed("e", {1.0})};
}

protocol::Recipe blocks_of(const std::vector<protocol::Axis>& mus) {
  std::vector<std::vector<protocol::Axis>> all;
  for (const protocol::Axis& mu : mus) {
    all.push_back(axes_with(mu));
  }
  return protocol::recipe_of(all);
}

const protocol::Axis kFiveMus = range("mu", 0.1, 0.5, 5);
const protocol::Axis kTwoMus = listed("mu", {0.7, 0.9});

TEST(RecipeGrowth, FurtherBlocksMakeItLongerHoweverTheFirstOnesAreWritten) {
  EXPECT_EQ(growth_of(blocks_of({kFiveMus}), blocks_of({kFiveMus, kTwoMus})).kind,
            Growth::Kind::kLonger);
  const auto rewritten = blocks_of({listed("mu", {0.1, 0.2, 0.3, 0.4, 0.5}), kTwoMus});
  EXPECT_EQ(growth_of(blocks_of({kFiveMus}), rewritten).kind, Growth::Kind::kLonger);
  EXPECT_EQ(growth_of(blocks_of({kFiveMus}), blocks_of({kFiveMus})).kind, Growth::Kind::kSame);
}

TEST(RecipeGrowth, FewerBlocksAreShorterAndTheNumbersAreSaid) {
  const Growth growth = growth_of(blocks_of({kFiveMus, kTwoMus}), blocks_of({kFiveMus}));
  EXPECT_EQ(growth.kind, Growth::Kind::kShorter);
  EXPECT_EQ(growth.difference, "stored 2 blocks, given 1");
}

TEST(RecipeGrowth, AnAxisThatDiffersIsNamedWithItsBlockAndBothValues) {
  const Growth growth = growth_of(blocks_of({kFiveMus, kTwoMus}),
                                  blocks_of({kFiveMus, listed("mu", {0.7, 0.8}), kTwoMus}));
  EXPECT_EQ(growth.kind, Growth::Kind::kOther);
  EXPECT_EQ(growth.difference, "block 2, mu: stored 0.7,0.9, given 0.7,0.8");
}

TEST(RecipeGrowth, AnAxisThatOneOfThemLacksIsNamed) {
  auto given =
      protocol::recipe_of({{listed("k", {1e7}), listed("H", {1.0}), kTwoMus, listed("e", {1.0})}});
  EXPECT_EQ(growth_of(blocks_of({kTwoMus}), given).difference,
            "block 1, k: stored none, given 1e+07");
  EXPECT_EQ(growth_of(given, blocks_of({kTwoMus})).difference,
            "block 1, k: stored 1e+07, given none");
}

TEST(RecipeGrowth, KeysOfTheModelAndTheChoiceOfErrorsAreNamed) {
  auto given = blocks_of({kFiveMus, kTwoMus});
  auto model = solver::preset("paper");
  model.k_N_m = 1e7;
  model.tolerance = 1e-7;
  *given.mutable_model() = protocol::to_message(model);
  given.set_errors(true);
  const Growth growth = growth_of(blocks_of({kFiveMus}), given);
  EXPECT_EQ(growth.kind, Growth::Kind::kOther);
  EXPECT_THAT(growth.difference, HasSubstr("model, k: stored 2.7e+07, given 1e+07\n"));
  EXPECT_THAT(growth.difference, HasSubstr("model, tolerance: stored none, given 1e-07\n"));
  EXPECT_THAT(growth.difference, HasSubstr("errors: stored false, given true"));
  EXPECT_THAT(growth.difference, Not(HasSubstr("block")));
}

TEST(RecipeGrowth, AStudyOnTheMeshOfThePaperSaysHowToGoOnWithItWhereOnlyTheMeshDiffers) {
  auto given = blocks_of({kFiveMus});
  *given.mutable_model() = protocol::to_message(solver::preset("standard"));
  const std::string way_on =
      "preset = \"paper\" below [model], or --preset paper, goes on with the stored one";
  EXPECT_EQ(growth_of(blocks_of({kFiveMus}), given).difference,
            "model, elements_per_link: stored 4, given 16\n" + way_on);
  EXPECT_THAT(growth_of(given, blocks_of({kFiveMus})).difference, Not(HasSubstr(way_on)));
  given.mutable_model()->set_k_n_m(1e7);
  EXPECT_THAT(growth_of(blocks_of({kFiveMus}), given).difference, Not(HasSubstr(way_on)));
}

TEST(RecipeGrowth, OfAxesInAnotherOrderTheOrderIsShown) {
  const auto one = protocol::recipe_of({{listed("k", {1e7, 2e7}), listed("eta2", {1.0}),
                                         listed("H", {1.0}), kTwoMus, listed("e", {1.0})}});
  const auto other = protocol::recipe_of({{listed("eta2", {1.0}), listed("k", {1e7, 2e7}),
                                           listed("H", {1.0}), kTwoMus, listed("e", {1.0})}});
  EXPECT_EQ(growth_of(one, other).difference,
            "block 1: stored k eta2 H mu e, given eta2 k H mu e, in another order");
}

TEST(RecipeGrowth, LongListsAreShownWhereTheyDiffer) {
  std::vector<double> values;
  for (int i = 0; i < 1000; ++i) {
    values.push_back(0.001 * i * i / 1000.0);
  }
  auto others = values;
  others.at(900) = 0.8101234;
  const Growth growth =
      growth_of(blocks_of({listed("mu", values)}), blocks_of({listed("mu", others)}));
  EXPECT_THAT(growth.difference, HasSubstr("0.8101234"));
  EXPECT_LT(growth.difference.size(), 250U);
}

TEST(RecipeGrowth, MuchThatDiffersIsShownInAFewLines) {
  std::vector<protocol::Axis> one;
  std::vector<protocol::Axis> other;
  for (int i = 0; i < 1000; ++i) {
    one.push_back(listed("mu", {0.001 * i}));
    other.push_back(listed("mu", {0.002 * i + 0.0001}));
  }
  const Growth growth = growth_of(blocks_of(one), blocks_of(other));
  EXPECT_THAT(growth.difference, HasSubstr("and 190 more at least"));
}

}  // namespace
}  // namespace oblique::server
