#include "proto/recipe/blocks.h"

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "tests/support/recipes.h"

namespace oblique::protocol {
namespace {

TEST(AxisTest, ARangeHasExactEndsAndRisesBetweenThem) {
  const Axis axis = range("mu", 0.1, 0.1 + 1e-12, 1000);
  EXPECT_EQ(axis_value(axis, 0), axis.from());
  EXPECT_EQ(axis_value(axis, 999), axis.to());
  for (std::uint64_t i = 1; i < 1000; ++i) {
    EXPECT_GE(axis_value(axis, i), axis_value(axis, i - 1)) << "value " << i;
  }
}

// Tests 1,000 grids that start at 1e7 or between 0 and 5. A step is at most 50 units of the last
// decimal.
TEST(AxisTest, EveryValueOfADecimalGridEqualsTheTypedNumber) {
  std::mt19937 random(1);
  const auto pick = [&](int from, int to) {
    return std::uniform_int_distribution<std::int64_t>(from, to)(random);
  };
  std::size_t values = 0;
  for (int grid = 0; grid < 1000; ++grid) {
    const auto decimals = static_cast<int>(pick(grid % 5 == 0 ? -7 : 1, 6));
    const std::int64_t first = pick(0, 5000);
    const std::int64_t step = pick(1, 50);
    const std::int64_t last = pick(1, 200);
    const auto number = [&](std::int64_t i) {
      const std::string text = std::to_string(first + step * i) + "e" + std::to_string(-decimals);
      return std::strtod(text.c_str(), nullptr);
    };
    const Axis axis = range("mu", number(0), number(last), static_cast<std::uint64_t>(last) + 1);
    for (std::int64_t i = 0; i <= last; ++i, ++values) {
      EXPECT_EQ(axis_value(axis, static_cast<std::uint64_t>(i)), number(i))
          << axis.from() << ":" << axis.to() << ":" << axis.count() << ", value " << i;
    }
  }
  EXPECT_GT(values, 50'000U);
}

TEST(AxisTest, ARangeWhoseStepHasMoreDecimalsOrNoneIsRoundedOnce) {
  EXPECT_EQ(axis_value(range("mu", 0.0, 1.0, 5), 3), 0.75);
  EXPECT_EQ(axis_value(range("mu", 0.1, 1.0, 19), 5), 0.35);
  const Axis huge = range("E", 1e300, 1e308, 1'000'000'001);
  EXPECT_DOUBLE_EQ(axis_value(huge, 500'000'000), 0.5 * (1e300 + 1e308));
  EXPECT_THROW(axis_value(huge, 1'000'000'001), std::out_of_range);
  EXPECT_EQ(axis_value(range("mu", 0.0, 1.0, 4), 1), 1.0 / 3.0);
  EXPECT_EQ(axis_value(range("mu", 0.0, 1.0 / 3.0, 3), 1), 1.0 / 6.0);
}

TEST(AxisTest, ALogarithmicRangeHasExactEndsAndDecimalValues) {
  const Axis decades = log_range("mu", 0.01, 100.0, 5);
  const Axis octaves = log_range("links", 1.0, 64.0, 7);
  for (std::uint64_t i = 0; i < 5; ++i) {
    EXPECT_EQ(axis_value(decades, i), std::vector({0.01, 0.1, 1.0, 10.0, 100.0})[i]);
  }
  for (std::uint64_t i = 0; i < 7; ++i) {
    EXPECT_EQ(axis_value(octaves, i), std::ldexp(1.0, static_cast<int>(i)));
  }
  const Axis many = log_range("mu", 0.3, 1.7, 1'000'000'000'000);
  EXPECT_NEAR(axis_value(many, many.count() / 2), std::sqrt(0.3 * 1.7), 1e-11);
  EXPECT_EQ(axis_value(many, many.count() - 1), 1.7);
}

using testing::ElementsAre;
using testing::HasSubstr;

TEST(BlockKindsTest, PointIOfAZipHasValueIOfEachAxisAndSingleValuesAreConstant) {
  const PointTable table(
      recipe_of_blocks({zipped({listed("k", {1e7, 2e7, 1e7}), listed("H", {0.3, 0.2, 0.3}),
                                log_range("mu", 0.1, 10.0, 3), listed("e", {0.9})})}));
  ASSERT_EQ(table.size(), 3U);
  EXPECT_EQ(table.models(), 3U);
  const std::vector<double> k{1e7, 2e7, 1e7};
  const std::vector<double> H{0.3, 0.2, 0.3};
  const std::vector<double> mu{0.1, 1.0, 10.0};
  for (std::uint64_t i = 0; i < 3; ++i) {
    const Point point = table.point(i);
    EXPECT_EQ(point.model, i);
    EXPECT_EQ(table.values(i), (std::vector{k[i], H[i], mu[i], 0.9}));
    EXPECT_EQ((std::vector{point.H_m, point.mu, point.e_star}), (std::vector{H[i], mu[i], 0.9}));
    EXPECT_EQ(table.model(i).k_N_m, k[i]);
    EXPECT_EQ(table.segment_at(i).count, 1U);
  }
}

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

TEST(BlockKindsTest, AnAxisMayBeComputedFromOthersInAnyOrder) {
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

TEST(BlockKindsTest, AModelThatDependsOnThePointIsDifferentForEachPoint) {
  const PointTable table(recipe_of({{following("k", "1e7 * H"), listed("H", {0.5, 0.6}),
                                     listed("mu", {0.1, 0.2}), listed("e", {1.0})}}));
  EXPECT_EQ(table.models(), 4U);
  EXPECT_EQ(table.model(3).k_N_m, 6e6);
  EXPECT_EQ(table.segment_at(2).count, 1U);
}

TEST(BlockKindsTest, SingleLengthsActAfterLinksAndLength) {
  const PointTable table(recipe_of(
      {{listed("length2", {0.1, 0.2}), listed("links", {2, 3}), listed("length", {0.3, 0.5}),
        listed("H", {0.2}), listed("mu", {0.4}), listed("e", {1.0})}}));
  EXPECT_EQ(table.models(), 8U);
  EXPECT_THAT(table.model(0).lengths_m, ElementsAre(0.3, 0.1));
  EXPECT_THAT(table.model(3).lengths_m, ElementsAre(0.5, 0.1, 0.5));
  EXPECT_THAT(table.model(6).lengths_m, ElementsAre(0.3, 0.2, 0.3));
}

TEST(BlockKindsTest, AnExpressionUsesTheLengthSetByLinks) {
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

TEST(KeysTest, EveryParameterKeyHasItsOwnNumber) {
  for (std::size_t i = 0; i <= key_number("e"); ++i) {
    EXPECT_EQ(key_number(key_numbered(i).name), i);
  }
  EXPECT_TRUE(is_point_key(key_number("mu")));
  EXPECT_FALSE(is_point_key(key_number("length64")));
  EXPECT_EQ(link_of_key(key_number("length2")), 1U);
  EXPECT_EQ(link_of_key(key_number("length")), std::nullopt);
}

std::string fault_of_points(const Block& block) {
  try {
    PointTable(recipe_of_blocks({block})).validate_points();
  } catch (const solver::InputError& fault) {
    return fault.what();
  }
  return {};
}

std::vector<std::uint64_t> left_in(const PointTable& table) {
  std::vector<std::uint64_t> points;
  for (std::uint64_t i = 0; i < table.size(); ++i) {
    if (table.passes_filter(i)) {
      points.push_back(i);
    }
  }
  return points;
}

/// Returns a block with mu = 0, 0.1, ..., 1 for each of two values of e.
Block grid(const std::string& where) {
  return filtered({listed("H", {0.5}), range("mu", 0.0, 1.0, 11), listed("e", {0.5, 1.0})}, where);
}

Block with_k(const std::string& k, std::uint64_t points, const std::string& where = "") {
  return filtered(
      {following("k", k), listed("H", {0.5}), range("mu", 0.0, 1.0, points), listed("e", {1.0})},
      where);
}

TEST(FilterTest, PointsThatAreLeftOutKeepTheirNumbersAndOtherBlocksTheirPoints) {
  const PointTable table(recipe_of_blocks({grid("mu > 1.9 * e"), grid(""), grid("mu < 0.05")}));
  EXPECT_EQ(table.size(), 66U);
  EXPECT_TRUE(table.has_filter() && table.has_points_to_validate());
  EXPECT_EQ(left_in(table).size(), 1U + 22U + 2U);
  EXPECT_EQ(table.point(20).mu, 1.0);
  EXPECT_EQ(table.first_passing(0, 66), 20U);
  EXPECT_EQ(table.first_passing(22, 66), 22U);
  EXPECT_EQ(table.first_passing(46, 66), 66U);
  EXPECT_EQ(table.first_passing(0, 10), 10U);
  EXPECT_THROW(static_cast<void>(table.passes_filter(66)), std::out_of_range);
  const PointTable plain(recipe_of_blocks({grid("")}));
  EXPECT_FALSE(plain.has_points_to_validate() || plain.has_filter());
}

TEST(FilterTest, AFilterMayUseExpressionsAndModelKeysInZipsAndSamples) {
  EXPECT_THAT(
      left_in(PointTable(recipe_of_blocks({with_k("1e7 * (1 + mu)", 11, "k > 1.85e7 && g > 9")}))),
      ElementsAre(9, 10));
  Block zip =
      zipped({listed("H", {0.3, 0.2, 0.5}), listed("mu", {0.1, 0.2, 0.3}), listed("e", {1.0})});
  zip.set_where("H > 0.25");
  EXPECT_THAT(left_in(PointTable(recipe_of_blocks({zip}))), ElementsAre(0, 2));
  Block sample = sampled({uniform("H", 0.3, 1.1), uniform("mu", 0.0, 1.0), uniform("e", 0.5, 1.0)},
                         SAMPLE_SOBOL, 1000);
  sample.set_where("mu > 0.5");
  EXPECT_NEAR(static_cast<double>(left_in(PointTable(recipe_of_blocks({sample}))).size()), 500.0,
              5.0);
}

TEST(ValidatedPointsTest, AValueThatIsNotAllowedIsAnErrorWithPointAndValues) {
  const Block beyond = zipped({listed("length", {0.1, 1.0}), listed("H", {0.5, 2.0}),
                               listed("mu", {0.4}), listed("e", {1.0})});
  Block reached = beyond;
  reached.mutable_axes(1)->set_values(0, 0.2);
  const Block outside = filtered({following("k", "1e7 * (0.55 - mu)"), listed("H", {0.5, 5.0}),
                                  range("mu", 0.0, 1.0, 11), listed("e", {1.0})},
                                 "mu < 0.5 && H < 1");
  for (const auto& [block, words] : std::vector<std::pair<Block, std::vector<const char*>>>{
           {with_k("1e7 * (0.55 - mu)", 11), {"point 6: k = ", "must be > 0", "mu = 0.6"}},
           {beyond, {"point 0: H = 0.5", "length = 0.1"}},
           {reached, {}},
           {outside, {}},
           {grid("sqrt(mu - 0.5) > 0.1"), {"point 0: where is not a number"}},
           {grid("mu > 2"), {"leaves out all points"}}}) {
    const std::string fault = fault_of_points(block);
    EXPECT_EQ(fault.empty(), words.empty()) << fault;
    for (const char* word : words) {
      EXPECT_THAT(fault, HasSubstr(word));
    }
  }
}

TEST(ValidatedPointsTest, InALargeStudyRandomPointsAreValidatedAndOthersFailWhenSolved) {
  constexpr std::uint64_t kMany = 100'000'001;
  EXPECT_THAT(fault_of_points(with_k("1e7 * (0.99 - mu)", kMany)), HasSubstr("k = "))
      << "one point in a hundred is invalid";
  EXPECT_EQ(fault_of_points(with_k("1e7", kMany, "mu > 2")), "")
      << "a filter that may keep unexamined points is accepted";
  const Block wrong_at_the_end = with_k("if(mu < 1, 1e7, -1)", kMany);
  EXPECT_EQ(fault_of_points(wrong_at_the_end), "");
  const PointTable table(recipe_of_blocks({wrong_at_the_end}));
  EXPECT_EQ(table.fault(0), "");
  EXPECT_THAT(table.fault(kMany - 1), HasSubstr("k = -1 N/m is not allowed"));
  EXPECT_EQ(table.model(kMany - 1).k_N_m, solver::preset("paper").k_N_m);
}

TEST(FallAxesTest, TheAxesThatChangeTheFallDependOnTheModelAndTheIntegratorOfTheBlock) {
  const auto keys_of = [](const std::vector<Axis>& axes, solver::ModelParameters model) {
    const Block block = sampled(axes, SAMPLE_SOBOL, 8);
    check_block(model, block);
    std::vector<std::string> keys;
    for (const Axis* axis : fall_axes(model, block)) {
      keys.push_back(axis->key());
    }
    return keys;
  };
  const std::vector<Axis> point{listed("H", {0.5}), listed("mu", {0.4}), listed("e", {1.0})};
  const auto with_point = [&](std::vector<Axis> axes) {
    axes.insert(axes.end(), point.begin(), point.end());
    return axes;
  };
  using Keys = std::vector<std::string>;
  solver::ModelParameters model;
  EXPECT_EQ(keys_of(with_point({uniform("E", 6e10, 7e10), uniform("k", 1e7, 2e7),
                                uniform("eta2", 1, 2), uniform("tolerance", 1e-6, 1e-4)}),
                    model),
            (Keys{"E", "tolerance"}));
  const auto radius = with_point({uniform("spectral_radius", 0.5, 0.9)});
  EXPECT_EQ(keys_of(radius, model), Keys{});
  model.integrator = solver::Integrator::kGeneralizedAlpha;
  EXPECT_EQ(keys_of(radius, model), Keys{"spectral_radius"});
  const auto both =
      with_point({listed("integrator", {0, 1}), uniform("spectral_radius", 0.5, 0.9)});
  const auto explicit_only =
      with_point({listed("integrator", {0}), uniform("spectral_radius", 0.5, 0.9)});
  EXPECT_EQ(keys_of(both, solver::ModelParameters()), (Keys{"integrator", "spectral_radius"}));
  EXPECT_EQ(keys_of(explicit_only, model), Keys{"integrator"});
  model.lengths_m = {0.3, 0.3, 0.3, 0.3};
  EXPECT_EQ(keys_of(with_point({uniform("length4", 0.2, 0.3)}), model), Keys{"length4"});
}

}  // namespace
}  // namespace oblique::protocol
