#include "server/study/study_table.h"

#include <cstdint>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "proto/recipe/model_message.h"
#include "tests/support/recipes.h"

namespace oblique::server {
namespace {

using protocol::listed;
using protocol::range;

protocol::Recipe recipe_of_mu(const protocol::Axis& mu) {
  return protocol::recipe_of({{listed("H", {1.0}), mu, listed("e", {1.0})}});
}

StudyTable judged(const protocol::Recipe& recipe) {
  return StudyTable(std::make_shared<const protocol::PointTable>(recipe));
}

StudyTable stored(const protocol::Recipe& recipe, std::uint64_t points) {
  return StudyTable(recipe.SerializeAsString(), points);
}

TEST(StudyTable, IsOfTheRecipeOfAnotherThatIsWrittenInAnotherWay) {
  const auto as_range = recipe_of_mu(range("mu", 0.1, 0.5, 2));
  const auto as_list = recipe_of_mu(listed("mu", {0.1, 0.5}));
  EXPECT_TRUE(judged(as_range).is_of_the_recipe_of(judged(as_list)));
  EXPECT_TRUE(stored(as_range, 2).is_of_the_recipe_of(judged(as_list)));
  EXPECT_TRUE(judged(as_range).is_of_the_recipe_of(stored(as_list, 2)));
}

TEST(StudyTable, GrowsByBlocksWhicheverOfBothTablesIsMadeAndByNothingElse) {
  protocol::Recipe before = recipe_of_mu(listed("mu", {0.1, 0.2}));
  protocol::Recipe longer = before;
  *longer.add_blocks() = recipe_of_mu(listed("mu", {0.3})).blocks(0);
  for (const bool with_errors : {false, true}) {
    before.set_errors(with_errors);
    longer.set_errors(with_errors);
    for (const StudyTable& one : {judged(before), stored(before, 2)}) {
      for (const StudyTable& other : {judged(longer), stored(longer, 3)}) {
        EXPECT_EQ(one.growth_to(other).kind, Growth::Kind::kLonger);
        EXPECT_EQ(other.growth_to(one).kind, Growth::Kind::kShorter);
        EXPECT_EQ(one.growth_to(one).kind, Growth::Kind::kSame);
      }
    }
  }
  before.set_errors(false);
  EXPECT_EQ(judged(before).growth_to(judged(longer)).kind, Growth::Kind::kOther) << "errors differ";
  longer.set_errors(false);
  *longer.mutable_model() = protocol::to_message(solver::preset("converged"));
  EXPECT_EQ(judged(before).growth_to(judged(longer)).kind, Growth::Kind::kOther) << "models differ";
}

TEST(StudyTable, IsNotOfARecipeWithAnotherPointOrModel) {
  const auto table = judged(recipe_of_mu(listed("mu", {0.1, 0.2})));
  EXPECT_FALSE(table.is_of_the_recipe_of(judged(recipe_of_mu(listed("mu", {0.2, 0.1})))));
  EXPECT_FALSE(table.is_of_the_recipe_of(judged(recipe_of_mu(listed("mu", {0.1})))));
  auto other_model = recipe_of_mu(listed("mu", {0.1, 0.2}));
  *other_model.mutable_model() = protocol::to_message(solver::preset("converged"));
  EXPECT_FALSE(table.is_of_the_recipe_of(judged(other_model)));
}

TEST(StudyTable, WhoseBytesAreDamagedIsOfNoOthersRecipe) {
  const StudyTable damaged(std::string("\xff"), 1);
  EXPECT_FALSE(damaged.is_of_the_recipe_of(judged(recipe_of_mu(listed("mu", {0.1})))));
}

TEST(StudyTable, ComparesWithoutMakingTheTableOfAStudyThatRests) {
  const auto resting = stored(recipe_of_mu(range("mu", 0.1, 0.5, 5)), 5);
  (void)resting.is_of_the_recipe_of(judged(recipe_of_mu(listed("mu", {1, 2, 3, 4, 5}))));
  EXPECT_FALSE(resting.is_made());
}

}  // namespace
}  // namespace oblique::server
