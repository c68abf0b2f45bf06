#include "server/study/study_table.h"

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
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

protocol::Recipe recipe_of_mu(const protocol::Axis& mu) {
  return protocol::recipe_of({{listed("H", {1.0}), mu, listed("e", {1.0})}});
}

StudyTable validated(const protocol::Recipe& recipe) {
  return StudyTable(std::make_shared<const protocol::PointTable>(recipe));
}

StudyTable stored(const protocol::Recipe& recipe, std::uint64_t points) {
  return StudyTable(recipe.SerializeAsString(), points);
}

TEST(StudyTable, OnlyAppendedBlocksAreAGrowthWhetherOrNotTablesAreMade) {
  protocol::Recipe before = recipe_of_mu(listed("mu", {0.1, 0.2}));
  protocol::Recipe longer = before;
  *longer.add_blocks() = recipe_of_mu(listed("mu", {0.3})).blocks(0);
  for (const bool with_errors : {false, true}) {
    before.set_errors(with_errors);
    longer.set_errors(with_errors);
    for (const StudyTable& one : {validated(before), stored(before, 2)}) {
      for (const StudyTable& other : {validated(longer), stored(longer, 3)}) {
        EXPECT_EQ(one.growth_to(other).kind, Growth::Kind::kLonger);
        EXPECT_EQ(other.growth_to(one).kind, Growth::Kind::kShorter);
        EXPECT_EQ(one.growth_to(one).kind, Growth::Kind::kSame);
      }
    }
  }
  before.set_errors(false);
  EXPECT_EQ(validated(before).growth_to(validated(longer)).kind, Growth::Kind::kOther)
      << "errors differ";
  longer.set_errors(false);
  *longer.mutable_model() = protocol::to_message(solver::preset("converged"));
  EXPECT_EQ(validated(before).growth_to(validated(longer)).kind, Growth::Kind::kOther)
      << "models differ";
}

TEST(StudyTable, DamagedBytesCannotBeCompared) {
  const StudyTable damaged(std::string("\xff"), 1);
  EXPECT_THROW(damaged.growth_to(validated(recipe_of_mu(listed("mu", {0.1})))), std::runtime_error);
}

TEST(StudyTable, ComparesWithoutMakingReleasedTables) {
  const auto resting = stored(recipe_of_mu(range("mu", 0.1, 0.5, 5)), 5);
  (void)resting.growth_to(validated(recipe_of_mu(listed("mu", {1, 2, 3, 4, 5}))));
  EXPECT_FALSE(resting.is_made());
}

protocol::Recipe blocks_of(const std::vector<protocol::Axis>& mus) {
  std::vector<std::vector<protocol::Axis>> all;
  for (const protocol::Axis& mu : mus) {
    all.push_back({listed("H", {1.0}), mu, listed("e", {1.0})});
  }
  return protocol::recipe_of(all);
}

const protocol::Axis kFiveMus = range("mu", 0.1, 0.5, 5);
const protocol::Axis kTwoMus = listed("mu", {0.7, 0.9});

protocol::Recipe recipe_of_sample(protocol::SampleKind kind, std::uint64_t count) {
  return protocol::recipe_of_blocks({protocol::sampled(
      {protocol::uniform("H", 0.3, 1.1), listed("mu", {0.4}), listed("e", {1.0})}, kind, count)});
}

TEST(RecipeGrowth, ARecipeWithFewerBlocksIsShorterAndBothNumbersAreNamed) {
  const Growth growth = growth_of(blocks_of({kFiveMus, kTwoMus}), blocks_of({kFiveMus}));
  EXPECT_EQ(growth.kind, Growth::Kind::kShorter);
  EXPECT_EQ(growth.difference, "stored 2 blocks, given 1");
}

TEST(RecipeGrowth, TheFirstBlockThatDiffersIsNamed) {
  const Growth growth = growth_of(blocks_of({kFiveMus, kTwoMus}),
                                  blocks_of({kFiveMus, listed("mu", {0.7, 0.8}), kTwoMus}));
  EXPECT_EQ(growth.kind, Growth::Kind::kOther);
  EXPECT_EQ(growth.difference, "block 2 differs");
}

TEST(RecipeGrowth, AxesInAnotherOrderDiffer) {
  const auto of = [](const protocol::Axis& first, const protocol::Axis& second) {
    return protocol::recipe_of({{first, second, listed("H", {1.0}), kTwoMus, listed("e", {1.0})}});
  };
  const auto k = listed("k", {1e7, 2e7});
  const auto eta2 = listed("eta2", {1.0});
  EXPECT_EQ(growth_of(of(k, eta2), of(eta2, k)).kind, Growth::Kind::kOther);
}

TEST(RecipeGrowth, DifferingModelKeysAndErrorsAreNamed) {
  auto given = blocks_of({kFiveMus, kTwoMus});
  auto model = solver::preset("paper");
  model.k_N_m = 1e7;
  model.tolerance = 1e-7;
  *given.mutable_model() = protocol::to_message(model);
  given.set_errors(true);
  const Growth growth = growth_of(blocks_of({kFiveMus}), given);
  EXPECT_EQ(growth.kind, Growth::Kind::kOther);
  EXPECT_EQ(growth.difference,
            "model, k: stored 2.7e+07, given 1e+07\nmodel, tolerance: stored 1e-05, given 1e-07\n"
            "errors: stored false, given true");
  EXPECT_THAT(growth_of(blocks_of({kTwoMus}), given).difference, HasSubstr("\nblock 1 differs"));
}

TEST(RecipeGrowth, ModelsWithOtherSingleLengthsDiffer) {
  auto given = blocks_of({kFiveMus});
  given.mutable_model()->set_lengths_m(1, 0.3);
  EXPECT_EQ(growth_of(blocks_of({kFiveMus}), given).difference,
            "model, lengths: the stored and the given ones differ");
}

TEST(RecipeGrowth, ALargerSampleIsAGrowthUnlessItIsALatinHypercube) {
  for (const auto kind : {protocol::SAMPLE_RANDOM, protocol::SAMPLE_SOBOL}) {
    EXPECT_EQ(growth_of(recipe_of_sample(kind, 10), recipe_of_sample(kind, 20)).kind,
              Growth::Kind::kLonger);
    const Growth smaller = growth_of(recipe_of_sample(kind, 20), recipe_of_sample(kind, 10));
    EXPECT_EQ(smaller.kind, Growth::Kind::kShorter);
    EXPECT_EQ(smaller.difference, "block 1: stored a sample of 20 points, given 10");
  }
  constexpr auto kHypercube = protocol::SAMPLE_LATIN_HYPERCUBE;
  EXPECT_THAT(
      growth_of(recipe_of_sample(kHypercube, 10), recipe_of_sample(kHypercube, 20)).difference,
      HasSubstr("cannot grow"));
  EXPECT_EQ(
      growth_of(recipe_of_sample(protocol::SAMPLE_RANDOM, 10), recipe_of_sample(kHypercube, 20))
          .difference,
      "block 1 differs");
}

TEST(RecipeGrowth, OnlyTheLastBlockMayBeALargerSample) {
  auto stored = recipe_of_sample(protocol::SAMPLE_SOBOL, 10);
  *stored.add_blocks() = blocks_of({kTwoMus}).blocks(0);
  auto given = recipe_of_sample(protocol::SAMPLE_SOBOL, 20);
  *given.add_blocks() = stored.blocks(1);
  EXPECT_EQ(growth_of(stored, given).difference, "block 1 differs");
}

}  // namespace
}  // namespace oblique::server
