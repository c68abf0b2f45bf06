// Points of blocks that are more than a product of lists and ranges.
#include <algorithm>
#include <cmath>
#include <map>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/axes.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/checks.h"
#include "proto/recipe/keys.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "tests/support/recipes.h"

namespace oblique::protocol {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string objection_to(const Recipe& recipe) {
  try {
    const PointTable table(recipe);
  } catch (const solver::InputError& fault) {
    return fault.what();
  }
  return {};
}

std::string objection_to(const Block& block) {
  return objection_to(recipe_of_blocks({block}));
}

// ---- Logarithmic spacing ----------------------------------------------------------------------

TEST(BlockKindsTest, EqualRatiosHaveTheirEndsAndTheNumbersThatOneTypes) {
  const Axis decades = log_range("mu", 0.01, 100.0, 5);
  EXPECT_EQ(axis_value(decades, 0), 0.01);
  EXPECT_EQ(axis_value(decades, 1), 0.1);
  EXPECT_EQ(axis_value(decades, 2), 1.0);
  EXPECT_EQ(axis_value(decades, 3), 10.0);
  EXPECT_EQ(axis_value(decades, 4), 100.0);
  const Axis octaves = log_range("links", 1.0, 64.0, 7);
  for (std::uint64_t i = 0; i < 7; ++i) {
    EXPECT_EQ(axis_value(octaves, i), std::ldexp(1.0, static_cast<int>(i)));
  }
}

TEST(BlockKindsTest, ALogarithmicRangeRisesStaysWithinItsEndsAndCostsNothingPerValue) {
  const Axis axis = log_range("mu", 0.3, 1.7, 1'000'000'000'000);
  const std::uint64_t last = axis.count() - 1;
  double before = 0.0;
  for (const std::uint64_t i :
       {std::uint64_t{0}, std::uint64_t{1}, last / 3, last / 2, last - 1, last}) {
    const double value = axis_value(axis, i);
    EXPECT_GE(value, before);
    EXPECT_LE(value, 1.7);
    before = value;
  }
  EXPECT_NEAR(axis_value(axis, last / 2), std::sqrt(0.3 * 1.7), 1e-11);
  EXPECT_EQ(first_value_from(axis, axis_value(axis, 12345)), 12345U);
}

TEST(BlockKindsTest, ALogarithmicRangeNeedsPositiveEndsAndAWholeNumberKeyWholeNumbers) {
  const auto with = [](const Axis& axis) {
    return objection_to(
        recipe_of({{axis, listed("H", {0.5}), listed("mu", {0.4}), listed("e", {1.0})}}));
  };
  EXPECT_THAT(objection_to(recipe_of(
                  {{listed("H", {0.5}), log_range("mu", 0.0, 1.0, 3), listed("e", {1.0})}})),
              HasSubstr("mu from 0"));
  EXPECT_EQ(with(log_range("elements_per_link", 1.0, 8.0, 4)), "");
  EXPECT_THAT(with(log_range("elements_per_link", 1.0, 8.0, 3)), HasSubstr("whole number"));
  EXPECT_THAT(with(log_range("elements_per_link", 1.0, 8.0, 1'000'000'000'000)),
              HasSubstr("whole number"));
}

// ---- Zip --------------------------------------------------------------------------------------

TEST(BlockKindsTest, AxesOfAZipGoSideBySideAndSingleValuesStandEverywhere) {
  const PointTable table(
      recipe_of_blocks({zipped({listed("k", {1e7, 2e7, 1e7}), listed("H", {0.3, 0.2, 0.3}),
                                log_range("mu", 0.1, 10.0, 3), listed("e", {0.9})})}));
  EXPECT_EQ(table.size(), 3U);
  EXPECT_EQ(table.models(), 3U);
  const std::vector<double> k{1e7, 2e7, 1e7};
  const std::vector<double> H{0.3, 0.2, 0.3};
  const std::vector<double> mu{0.1, 1.0, 10.0};
  for (std::uint64_t i = 0; i < 3; ++i) {
    const Point point = table.point(i);
    EXPECT_EQ(point.model, i);
    EXPECT_EQ(point.H_m, H[i]);
    EXPECT_EQ(point.mu, mu[i]);
    EXPECT_EQ(point.e_star, 0.9);
    EXPECT_EQ(table.model(i).k_N_m, k[i]);
    EXPECT_EQ(table.segment_at(i).count, 1U);
  }
}

TEST(BlockKindsTest, AZipWithoutModelKeysSharesItsModelWithOtherBlocks) {
  const PointTable table(recipe_of_blocks(
      {zipped({listed("H", {0.3, 0.2}), listed("mu", {0.1, 0.2}), listed("e", {1.0})}),
       filtered({listed("H", {0.3}), listed("mu", {0.1, 0.2}), listed("e", {1.0})}, "")}));
  EXPECT_EQ(table.models(), 1U);
  EXPECT_EQ(table.segment_at(1).count, 4U);
}

TEST(BlockKindsTest, AxesOfAZipHaveAsManyValuesEach) {
  EXPECT_THAT(objection_to(zipped(
                  {listed("H", {0.3, 0.2}), listed("mu", {0.1, 0.2, 0.3}), listed("e", {1.0})})),
              HasSubstr("H has 2 values and another axis 3"));
}

TEST(BlockKindsTest, InAZipEachHMustBeInReachOfItsOwnFinger) {
  const Block reached = zipped({listed("length", {0.1, 1.0}), listed("H", {0.2, 2.0}),
                                listed("mu", {0.4}), listed("e", {1.0})});
  PointTable table(recipe_of_blocks({reached}));
  EXPECT_TRUE(table.needs_judging());
  EXPECT_NO_THROW(table.judge_points());
  Block beyond = reached;
  beyond.mutable_axes(1)->set_values(0, 0.5);
  PointTable wrong(recipe_of_blocks({beyond}));
  try {
    wrong.judge_points();
    FAIL();
  } catch (const solver::InputError& fault) {
    EXPECT_THAT(fault.what(), HasSubstr("point 0: H = 0.5"));
    EXPECT_THAT(fault.what(), HasSubstr("length = 0.1"));
  }
}

// ---- Samples ----------------------------------------------------------------------------------

TEST(BlockKindsTest, ASampleDrawsWithinItsDistributionsAndKeepsSingleValues) {
  for (const SampleKind kind : {SAMPLE_RANDOM, SAMPLE_LATIN_HYPERCUBE, SAMPLE_SOBOL}) {
    Axis normal = uniform("mu", 0.0, 1.0);
    normal.mutable_distribution()->set_kind(DISTRIBUTION_NORMAL);
    normal.mutable_distribution()->set_mean(0.4);
    normal.mutable_distribution()->set_sd(0.05);
    const PointTable table(recipe_of_blocks(
        {sampled({uniform("H", 0.3, 1.1), normal, listed("e", {0.9})}, kind, 1024)}));
    EXPECT_EQ(table.size(), 1024U);
    EXPECT_EQ(table.models(), 1U);
    double sum_H = 0.0;
    double sum_mu = 0.0;
    for (std::uint64_t i = 0; i < table.size(); ++i) {
      const Point point = table.point(i);
      EXPECT_GT(point.H_m, 0.3);
      EXPECT_LT(point.H_m, 1.1);
      EXPECT_EQ(point.e_star, 0.9);
      sum_H += point.H_m;
      sum_mu += point.mu;
    }
    EXPECT_NEAR(sum_H / 1024.0, 0.7, 0.03);
    EXPECT_NEAR(sum_mu / 1024.0, 0.4, 0.01);
  }
}

TEST(BlockKindsTest, ValuesOfAListAreDrawnWithEqualChances) {
  const PointTable table(
      recipe_of_blocks({sampled({listed("elements_per_link", {2, 4, 8}), uniform("H", 0.3, 1.1),
                                 listed("mu", {0.4}), listed("e", {1.0})},
                                SAMPLE_LATIN_HYPERCUBE, 300)}));
  EXPECT_EQ(table.models(), 300U);
  std::map<int, int> drawn;
  for (std::uint64_t i = 0; i < 300; ++i) {
    ++drawn[table.model(table.point(i).model).elements_per_link];
  }
  EXPECT_THAT(drawn,
              ElementsAre(testing::Pair(2, 100), testing::Pair(4, 100), testing::Pair(8, 100)));
}

TEST(BlockKindsTest, AThousandMillionSobolPointsCostNothing) {
  const Recipe recipe =
      recipe_of_blocks({sampled({following("I", "A^2 / (4 * pi)"), uniform("H", 0.3, 1.1),
                                 uniform("mu", 0.1, 0.5), uniform("e", 0.5, 1.0)},
                                SAMPLE_SOBOL, 1'000'000'000'000)});
  const PointTable table(recipe);
  EXPECT_EQ(table.size(), 1'000'000'000'000U);
  EXPECT_EQ(table.models(), 1U);
  EXPECT_NE(table.point(999'999'999'999).mu, table.point(0).mu);
}

TEST(BlockKindsTest, EarlierPointsOfASobolSampleStayWhereTheyAreWhenItGrows) {
  const auto of_count = [](std::uint64_t count) {
    return PointTable(recipe_of_blocks(
        {sampled({uniform("H", 0.3, 1.1), uniform("mu", 0.1, 0.5), listed("e", {1.0})},
                 SAMPLE_SOBOL, count)}));
  };
  const PointTable few = of_count(10);
  const PointTable many = of_count(1000);
  for (std::uint64_t i = 0; i < few.size(); ++i) {
    EXPECT_EQ(few.point(i).H_m, many.point(i).H_m);
    EXPECT_EQ(few.point(i).mu, many.point(i).mu);
  }
}

TEST(BlockKindsTest, DistributionsThatReachValuesThatAreNotAllowedAreRefused) {
  const auto with = [](const Axis& mu) {
    return objection_to(sampled({listed("H", {0.5}), mu, listed("e", {1.0})}, SAMPLE_RANDOM, 10));
  };
  Axis normal;
  normal.set_key("mu");
  normal.mutable_distribution()->set_kind(DISTRIBUTION_NORMAL);
  normal.mutable_distribution()->set_mean(0.4);
  normal.mutable_distribution()->set_sd(0.05);
  EXPECT_THAT(with(normal), HasSubstr("cut it off with `from`"));
  normal.mutable_distribution()->set_from(0.0);
  EXPECT_EQ(with(normal), "");
  normal.mutable_distribution()->set_sd(0.0);
  EXPECT_THAT(with(normal), HasSubstr("sd = 0"));
  normal.mutable_distribution()->set_sd(1e-3);
  normal.mutable_distribution()->set_from(1e3);
  EXPECT_THAT(with(normal), HasSubstr("nothing is left"));
  EXPECT_THAT(with(uniform("mu", -0.1, 1.0)), HasSubstr("mu = -0.1"));
  EXPECT_THAT(with(uniform("mu", 1.0, 0.5)), HasSubstr("swap"));
  Axis logarithmic = uniform("mu", 0.0, 1.0);
  logarithmic.mutable_distribution()->set_kind(DISTRIBUTION_LOG_UNIFORM);
  EXPECT_THAT(with(logarithmic), HasSubstr("logarithm"));
  EXPECT_THAT(with(listed("mu", {0.4})), HasSubstr("nothing to draw"));
  EXPECT_THAT(
      objection_to(filtered({listed("H", {0.5}), uniform("mu", 0.0, 1.0), listed("e", {1.0})}, "")),
      HasSubstr("only a sample draws"));
  EXPECT_THAT(objection_to(sampled({uniform("elements_per_link", 2.0, 8.0), listed("H", {0.5}),
                                    listed("mu", {0.4}), listed("e", {1.0})},
                                   SAMPLE_RANDOM, 10)),
              HasSubstr("list the values"));
  EXPECT_THAT(
      objection_to(sampled({uniform("H", 0.5, 0.6), listed("mu", {0.4}), listed("e", {1.0})},
                           SAMPLE_SOBOL, 0)),
      HasSubstr("count"));
}

// ---- Expressions ------------------------------------------------------------------------------

TEST(BlockKindsTest, AnAxisFollowsFromOthersInWhateverOrderTheyStand) {
  const PointTable table(
      recipe_of({{following("I", "A^2 / (4 * pi) * eta2"), listed("A", {1e-4, 2e-4}),
                  following("eta2", "1 + rho / 2700"), listed("H", {0.5, 0.6}),
                  following("mu", "H / 2"), listed("e", {1.0})}}));
  EXPECT_EQ(table.size(), 4U);
  EXPECT_EQ(table.models(), 2U);
  for (std::uint64_t i = 0; i < 4; ++i) {
    const Point point = table.point(i);
    EXPECT_EQ(point.model, i / 2);
    EXPECT_EQ(point.mu, point.H_m / 2.0);
    const auto model = table.model(point.model);
    EXPECT_EQ(model.eta2, 2.0);
    EXPECT_DOUBLE_EQ(model.I_m4, model.A_m2 * model.A_m2 / (4.0 * std::acos(-1.0)) * 2.0);
  }
}

TEST(BlockKindsTest, AModelThatFollowsFromThePointIsOneOfItsOwn) {
  const PointTable table(recipe_of({{following("k", "1e7 * H"), listed("H", {0.5, 0.6}),
                                     listed("mu", {0.1, 0.2}), listed("e", {1.0})}}));
  EXPECT_EQ(table.models(), 4U);
  EXPECT_EQ(table.model(3).k_N_m, 6e6);
  EXPECT_EQ(table.segment_at(2).count, 1U);
}

TEST(BlockKindsTest, ExpressionsThatGoRoundInACircleOrAskForUnknownKeysAreRefused) {
  const auto with = [](const Axis& a, const Axis& b) {
    return objection_to(
        recipe_of({{a, b, listed("H", {0.5}), listed("mu", {0.4}), listed("e", {1.0})}}));
  };
  EXPECT_THAT(with(following("E", "k"), following("k", "E")), HasSubstr("circle"));
  EXPECT_THAT(with(following("E", "E * 2"), listed("k", {1e7})), HasSubstr("circle"));
  EXPECT_THAT(with(following("E", "muu * 2"), listed("k", {1e7})), HasSubstr("did you mean `mu`?"));
  EXPECT_THAT(with(following("E", "2 +"), listed("k", {1e7})),
              HasSubstr("E = \"2 +\": a value is missing"));
}

TEST(BlockKindsTest, AStudyHasABoundedNumberOfExpressions) {
  const Block block =
      filtered({listed("H", {0.5}), following("mu", "H / 2"), listed("e", {1.0})}, "");
  EXPECT_EQ(objection_to(recipe_of_blocks(std::vector<Block>(kMostExpressions, block))), "");
  EXPECT_THAT(objection_to(recipe_of_blocks(std::vector<Block>(kMostExpressions + 1, block))),
              HasSubstr("more than 1000 expressions"));
}

TEST(BlockKindsTest, ValuesThatAreNotAllowedFailTheirPointWhereNobodyCouldLook) {
  const Recipe recipe = recipe_of({{following("k", "if(mu < 1, 1e7, -1)"), listed("H", {0.5}),
                                    range("mu", 0.0, 1.0, 200'000'001), listed("e", {1.0})}});
  const PointTable table(recipe);
  EXPECT_NO_THROW(table.judge_points()) << "only the last of so many points is wrong";
  EXPECT_EQ(table.fault(0), "");
  EXPECT_THAT(table.fault(200'000'000), HasSubstr("k = -1 N/m is not allowed"));
  EXPECT_EQ(table.model(200'000'000).k_N_m, solver::preset("paper").k_N_m);
}

TEST(BlockKindsTest, SeveralThreadsMayUseOneTable) {
  const PointTable table(recipe_of({{following("k", "1e7 * (1 + mu)"), listed("H", {0.5}),
                                     range("mu", 0.0, 1.0, 5001), listed("e", {1.0})}}));
  std::vector<std::thread> threads;
  std::vector<int> wrong(4, 0);
  for (std::size_t t = 0; t < wrong.size(); ++t) {
    threads.emplace_back([&, t] {
      for (std::uint64_t i = t; i < table.size(); i += 3) {
        const Point point = table.point(i);
        wrong[t] += table.model(point.model).k_N_m == 1e7 * (1.0 + point.mu) ? 0 : 1;
      }
    });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  EXPECT_THAT(wrong, testing::Each(0));
}

// ---- Single lengths ---------------------------------------------------------------------------

TEST(BlockKindsTest, SingleLengthsActOnWhatLinksAndLengthHaveMade) {
  const PointTable table(recipe_of(
      {{listed("length2", {0.1, 0.2}), listed("links", {2, 3}), listed("length", {0.3, 0.5}),
        listed("H", {0.2}), listed("mu", {0.4}), listed("e", {1.0})}}));
  EXPECT_EQ(table.models(), 8U);
  EXPECT_THAT(table.model(0).lengths_m, ElementsAre(0.3, 0.1));
  EXPECT_THAT(table.model(3).lengths_m, ElementsAre(0.5, 0.1, 0.5));
  EXPECT_THAT(table.model(6).lengths_m, ElementsAre(0.3, 0.2, 0.3));
}

TEST(BlockKindsTest, AnExpressionSeesTheLengthThatLinksMake) {
  Recipe recipe = recipe_of({{listed("links", {2, 3}), following("tip_mass", "length2"),
                              listed("H", {0.2}), listed("mu", {0.4}), listed("e", {1.0})}});
  solver::ModelParameters base = solver::preset("paper");
  base.lengths_m = {0.4, 0.3};
  *recipe.mutable_model() = to_message(base);
  const PointTable table(recipe);
  for (const std::uint64_t point : {0U, 1U}) {
    const auto model = table.model(table.point(point).model);
    EXPECT_EQ(model.tip_mass_kg, model.lengths_m[1]) << point;
  }
}

TEST(BlockKindsTest, ASingleLengthIsThatOfALinkAndCountsForTheReach) {
  const auto with = [](const Axis& axis, double H_m) {
    return objection_to(
        recipe_of({{axis, listed("H", {H_m}), listed("mu", {0.4}), listed("e", {1.0})}}));
  };
  EXPECT_EQ(with(listed("length3", {0.1}), 0.9), "");
  EXPECT_THAT(with(listed("length3", {0.1}), 0.95), HasSubstr("H = 0.95"));
  EXPECT_THAT(with(listed("length4", {0.1}), 0.5), HasSubstr("length4 is not allowed"));
  EXPECT_THAT(with(listed("length0", {0.1}), 0.5), HasSubstr("unknown key"));
  EXPECT_THAT(with(listed("length65", {0.1}), 0.5), HasSubstr("unknown key"));
  EXPECT_THAT(with(listed("length1", {0.0}), 0.5), HasSubstr("length1 = 0"));
}

TEST(BlockKindsTest, EveryKeyHasItsNumber) {
  for (std::size_t i = 0; i < key_count(); ++i) {
    EXPECT_EQ(key_number(key_numbered(i).name), i);
  }
  EXPECT_TRUE(is_point_key(key_number("mu")));
  EXPECT_FALSE(is_point_key(key_number("length64")));
  EXPECT_EQ(link_of_key(key_number("length2")), 1U);
  EXPECT_EQ(link_of_key(key_number("length")), std::nullopt);
}

}  // namespace
}  // namespace oblique::protocol
