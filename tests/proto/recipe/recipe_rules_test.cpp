// Tests of the rules for recipes, and of the messages when a rule is broken.
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "tests/support/recipes.h"

namespace oblique::protocol {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string refusal(const Recipe& recipe) {
  try {
    const PointTable table(recipe);
    return "";
  } catch (const solver::InputError& error) {
    return error.what();
  }
}
std::string refusal(const Block& block) {
  return refusal(recipe_of_blocks({block}));
}

const Axis kH = listed("H", {0.5});
const Axis kMu = listed("mu", {0.4});
const Axis kE = listed("e", {1.0});

/// Return a block that contains the given axis.
Block of_mu(const Axis& mu) {
  return filtered({listed("H", {1.0}), mu, kE}, "");
}
Block with(const Axis& model_axis, double H_m = 1.0) {
  return filtered({model_axis, listed("H", {H_m}), kMu, kE}, "");
}
Block drawing(const Axis& mu) {
  return sampled({kH, mu, kE}, SAMPLE_RANDOM, 10);
}

Axis normal(double mean, double sd, std::optional<double> from = {}) {
  Axis axis;
  axis.set_key("mu");
  Distribution& drawn = *axis.mutable_distribution();
  drawn.set_kind(DISTRIBUTION_NORMAL);
  drawn.set_mean(mean);
  drawn.set_sd(sd);
  if (from) {
    drawn.set_from(*from);
  }
  return axis;
}

Axis log_uniform(double from, double to) {
  Axis axis = uniform("mu", from, to);
  axis.mutable_distribution()->set_kind(DISTRIBUTION_LOG_UNIFORM);
  return axis;
}

Axis with_value(Axis axis, double value) {
  axis.add_values(value);
  return axis;
}

struct Refused {
  Block block;
  std::string key = {};       ///< key that the error names
  std::string expected = {};  ///< part of the message; empty if the block is allowed
};

void expect_refusals(const std::vector<Refused>& blocks) {
  for (const Refused& each : blocks) {
    solver::InputError::Fields error;
    try {
      const PointTable table(recipe_of_blocks({each.block}));
    } catch (const solver::InputError& refused) {
      error = refused.fields();
    }
    EXPECT_EQ(error.key, each.key) << each.block.DebugString();
    EXPECT_EQ(error.text.empty(), each.expected.empty()) << error.text << each.block.DebugString();
    EXPECT_THAT(error.text, HasSubstr(each.expected)) << each.block.DebugString();
  }
}

TEST(RecipeRules, KeysMustBeKnownUniqueAndInOrder) {
  expect_refusals({
      {with(listed("wobble", {1.0})), "wobble", "unknown key `wobble`: the keys are"},
      {filtered({kH, kMu, listed("mu", {0.5}), kE}, ""), "mu", "mu appears twice"},
      {filtered({kMu, kE}, ""), "H", "H is missing"},
      {filtered({kH, kE}, ""), "mu", "mu is missing"},
      {filtered({kH, kMu}, ""), "e", "e is missing"},
      {filtered({}, ""), "H", "H is missing"},
      {filtered({kMu, kH, kE}, ""), "mu", "out of order"},
      {filtered({kH, kMu, kE, listed("k", {1e7})}, ""), "mu", "out of order"},
  });
  EXPECT_LT(refusal(with(listed(std::string(100'000, 'x'), {1.0}))).size(), 500U);
}

TEST(RecipeRules, ListsAndRangesHaveAllowedValues) {
  expect_refusals({
      {of_mu(kMu)},
      {of_mu(range("mu", 0.4, 0.4, 1))},
      {of_mu(listed("mu", {0.5, 0.4, 0.6}))},
      {with(range("links", 3, 6, 4))},
      {with(log_range("elements_per_link", 1.0, 8.0, 4))},
      {of_mu(listed("mu", {})), "mu", "mu = [] has no values"},
      {of_mu(with_value(range("mu", 0.1, 0.2, 2), 0.4)), "mu", "mu has values of several kinds"},
      {of_mu(range("mu", 2.0, 0.5, 4)), "mu", "from 2 to 0.5 is reversed"},
      {of_mu(range("mu", 0.5, 2.0, 1)), "mu", "contains both ends"},
      {of_mu(range("mu", 0.5, 0.5, 7)), "mu", "count = 7 is not allowed with equal ends 0.5"},
      {of_mu(listed("mu", {kNan})), "mu", "mu = nan"},
      {of_mu(listed("mu", {kInfinity})), "mu", "mu = inf"},
      {of_mu(range("mu", 0.0, kInfinity, 3)), "mu", "mu = inf"},
      {of_mu(range("mu", kNan, 1.0, 3)), "mu", "mu = nan"},
      {of_mu(listed("mu", {0.4, -0.1})), "mu", "mu = -0.1 is not allowed: mu must be >= 0"},
      {filtered({kH, kMu, range("e", 0.0, 1.0, 3)}, ""), "e", "e must be in [0.001, 1]"},
      {filtered({listed("H", {-1.0}), kMu, kE}, ""), "H", "H = -1"},
      {with(listed("k", {0.0})), "k", "k = 0"},
      {of_mu(listed("mu", {0.5, 0.4, 0.3, 0.4})), "mu", "mu has 0.4 twice"},
      {of_mu(listed("mu", {0.0, 1.0, -0.0})), "mu", "twice"},
      {of_mu(log_range("mu", 0.0, 1.0, 3)), "mu", "mu from 0"},
      {with(range("elements_per_link", 2, 8, 5)), "elements_per_link", "elements_per_link = 3.5"},
      {with(log_range("elements_per_link", 1.0, 8.0, 3)), "elements_per_link", "whole number"},
      {with(log_range("elements_per_link", 1.0, 8.0, 1'000'000'000'000)), "elements_per_link",
       "whole number"},
  });
}

TEST(RecipeRules, ARangeIsRefusedExactlyWhenOneOfItsValuesIsNotAllowed) {
  const solver::ParameterKey& key = *solver::find_model_key("elements_per_link");
  for (const double from : {1.0, 2.0, 7.0}) {
    for (const double to : {8.0, 13.0, 256.0}) {
      for (std::uint64_t count = 2; count <= 520; ++count) {
        const Axis axis = range("elements_per_link", from, to, count);
        bool all_allowed = true;
        for (std::uint64_t i = 0; i < count; ++i) {
          all_allowed = all_allowed && key.is_allowed(axis_value(axis, i));
        }
        EXPECT_EQ(refusal(with(axis)).empty(), all_allowed) << from << ":" << to << ":" << count;
      }
    }
  }
}

TEST(RecipeRules, HMustNotExceedTheShortestFingerOfTheBlock) {
  expect_refusals({
      {filtered({range("H", 0.9, 1.3, 5), kMu, kE}, ""), "H", "the length of the chain, 1.2 m"},
      {with(listed("length", {0.4, 0.3})), "H", "0.9 m"},
      {with(range("links", 2, 4, 3)), "H", "0.8 m"},
      {with(listed("length3", {0.1}), 0.9)},
      {with(listed("length3", {0.1}), 0.95), "H", "H = 0.95"},
      {with(listed("length4", {0.1}), 0.5), "length4", "length4 is not allowed"},
      {with(listed("length0", {0.1}), 0.5), "length0", "unknown key"},
      {with(listed("length65", {0.1}), 0.5), "length65", "unknown key"},
      {with(listed("length1", {0.0}), 0.5), "length1", "length1 = 0"},
  });
}

TEST(RecipeRules, AxesMustFitZipsAndSamples) {
  expect_refusals({
      {zipped({listed("H", {0.3, 0.2}), listed("mu", {0.1, 0.2, 0.3}), kE}), "H",
       "H has 2 values and another axis 3"},
      {drawing(normal(0.4, 0.05)), "mu", "truncate it with `from`"},
      {drawing(normal(0.4, 0.05, 0.0))},
      {drawing(normal(0.4, 0.0, 0.0)), "mu", "sd = 0"},
      {drawing(normal(0.4, 1e-3, 1e3)), "mu", "has no values from"},
      {drawing(uniform("mu", -0.1, 1.0)), "mu", "mu = -0.1"},
      {drawing(uniform("mu", 1.0, 0.5)), "mu", "swap"},
      {drawing(log_uniform(0.0, 1.0)), "mu", "logarithm"},
      {drawing(kMu), "sample", "nothing to draw"},
      {filtered({kH, uniform("mu", 0.0, 1.0), kE}, ""), "mu", "only a sample draws"},
      {sampled({uniform("elements_per_link", 2.0, 8.0), kH, kMu, kE}, SAMPLE_RANDOM, 10),
       "elements_per_link", "list the values"},
      {sampled({uniform("H", 0.5, 0.6), kMu, kE}, SAMPLE_SOBOL, 0), "sample", "count"},
  });
}

TEST(RecipeRules, ExpressionsMustBeValid) {
  const auto both = [](const Axis& a, const Axis& b) { return filtered({a, b, kH, kMu, kE}, ""); };
  expect_refusals({
      {both(following("E", "k"), following("k", "E")), "E", "circle"},
      {both(following("E", "E * 2"), listed("k", {1e7})), "E", "circle"},
      {both(following("E", "muu * 2"), listed("k", {1e7})), "E", "did you mean `mu`?"},
      {both(following("E", "2 +"), listed("k", {1e7})), "E", "a value is missing"},
      {with(following("E", "length4")), "E", "`length4` is not a key"},
  });
  EXPECT_THAT(refusal(with(following("E", "2 +"))), StartsWith("E = \"2 +\": a value is missing"));
}

TEST(RecipeRules, AStudyHasABoundedNumberOfExpressionsBlocksAndPoints) {
  const Block expressed = filtered({kH, following("mu", "H / 2"), kE}, "");
  EXPECT_EQ(refusal(recipe_of_blocks(std::vector<Block>(kMaxExpressions, expressed))), "");
  EXPECT_THAT(refusal(recipe_of_blocks(std::vector<Block>(kMaxExpressions + 1, expressed))),
              HasSubstr("more than 1000 expressions"));
  EXPECT_THAT(refusal(recipe_of_blocks(std::vector<Block>(kMaxBlocks + 1, of_mu(kMu)))),
              HasSubstr("10001 blocks, more than 10000"));
  const std::uint64_t huge = std::numeric_limits<std::uint64_t>::max();
  const std::uint64_t half = std::uint64_t{1} << 32U;  // half * half overflows to 0
  const Block most =
      filtered({kH, range("mu", 0, 1, 1'000'000), range("e", 0.5, 1, 1'000'000)}, "");
  EXPECT_EQ(refusal(most), "");
  for (const Recipe& recipe : {recipe_of_blocks({of_mu(range("mu", 0.0, 1.0, huge))}),
                               recipe_of({{kH, range("mu", 0, 1, half), range("e", 0.5, 1, half)}}),
                               recipe_of_blocks({most, most})}) {
    EXPECT_THAT(refusal(recipe), HasSubstr("more than 1000000000000"));
  }
}

TEST(RecipeRules, ARangeWhoseValuesWouldBeEqualIsRefused) {
  const double above = std::nextafter(0.3, 1.0);
  for (const Axis& axis : {range("mu", 0.3, above, 3), log_range("mu", 0.3, above, 3),
                           range("mu", 0.3, 0.3 + 1e-14, 1000), range("mu", 0.0, 5e-324, 3),
                           log_range("mu", 0.3, 0.3 * (1.0 + 1e-13), 10'000)}) {
    EXPECT_THAT(refusal(of_mu(axis)), HasSubstr("some of the values would be equal"));
  }
  for (const Axis& axis : {range("mu", 0.3, 0.3 + 1e-14, 10), range("mu", 0.0, 1e-300, 1000),
                           log_range("mu", 1e-3, 1.0, 1'000'000'000)}) {
    EXPECT_EQ(refusal(of_mu(axis)), "");
  }
}

TEST(RecipeRules, ARecipeTooLongForAWorkerIsRefused) {
  Recipe recipe = recipe_of({{listed("mu", {})}});
  recipe.mutable_blocks(0)->mutable_axes(0)->mutable_values()->Resize(1 << 20, 0.5);
  EXPECT_NO_THROW(check_size(recipe));
  recipe.mutable_blocks(0)->mutable_axes(0)->mutable_values()->Resize(1 << 21, 0.5);
  EXPECT_THROW(check_size(recipe), solver::InputError);
}

TEST(RecipeRules, ARecipeNeedsBlocksAndAnAllowedModel) {
  EXPECT_THAT(refusal(recipe_of({})), HasSubstr("no block"));
  EXPECT_THAT(refusal(recipe_of_blocks({of_mu(kMu), of_mu(listed("mu", {-1}))})),
              StartsWith("block 2: mu = -1"));
  Recipe recipe = recipe_of_blocks({of_mu(kMu)});
  recipe.mutable_model()->set_e_pa(-1.0);
  EXPECT_THAT(refusal(recipe), HasSubstr("E = -1"));
  recipe.clear_model();
  EXPECT_THAT(refusal(recipe), HasSubstr("the recipe has no model"));
}

}  // namespace
}  // namespace oblique::protocol
