#include "client/explore/sensitivity.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <set>
#include <span>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

namespace oblique::client {
namespace {

/// A function on the unit cube.
using Function = std::function<double(std::span<const double> u)>;

/// A function with known sensitivity indices.
struct KnownFunction {
  Function f;
  std::vector<double> first;
  std::vector<double> total;
};

/// f = sin x1 + a sin^2 x2 + b x3^4 sin x1 with x uniform in (-pi, pi). T. Ishigami and T. Homma,
/// An importance quantification technique in uncertainty analysis (1990).
KnownFunction ishigami() {
  constexpr double a = 7.0;
  constexpr double b = 0.1;
  const double pi4 = std::pow(std::numbers::pi, 4.0);
  const double V1 = 0.5 * std::pow(1.0 + b * pi4 / 5.0, 2.0);
  const double V2 = a * a / 8.0;
  const double V13 = 8.0 * b * b * pi4 * pi4 / 225.0;
  const double V = V1 + V2 + V13;
  return {.f =
              [](std::span<const double> u) {
                const auto x = [u](std::size_t i) { return std::numbers::pi * (2.0 * u[i] - 1.0); };
                return std::sin(x(0)) + a * std::pow(std::sin(x(1)), 2.0) +
                       b * std::pow(x(2), 4.0) * std::sin(x(0));
              },
          .first = {V1 / V, V2 / V, 0.0},
          .total = {(V1 + V13) / V, V2 / V, V13 / V}};
}

/// The product of (|4 u - 2| + a_i)/(1 + a_i). I. M. Sobol', Theorems and examples on high
/// dimensional model representation, Reliab. Eng. Syst. Saf. 79 (2003).
KnownFunction g_function(const std::vector<double>& a) {
  KnownFunction g{.f =
                      [a](std::span<const double> u) {
                        double product = 1.0;
                        for (std::size_t i = 0; i < a.size(); ++i) {
                          product *= (std::abs(4.0 * u[i] - 2.0) + a[i]) / (1.0 + a[i]);
                        }
                        return product;
                      },
                  .first = {},
                  .total = {}};
  double product = 1.0;
  for (const double ai : a) {
    product *= 1.0 + 1.0 / (3.0 * (1.0 + ai) * (1.0 + ai));
  }
  const double V = product - 1.0;
  for (const double ai : a) {
    const double Vi = 1.0 / (3.0 * (1.0 + ai) * (1.0 + ai));
    g.first.push_back(Vi / V);
    g.total.push_back(Vi * product / (1.0 + Vi) / V);
  }
  return g;
}

/// Returns the outputs of `f`. `coordinates` contains `inputs` coordinates for each point.
std::vector<double> outputs_at(const Function& f, std::span<const double> coordinates,
                               std::size_t inputs) {
  std::vector<double> outputs;
  for (std::size_t at = 0; at < coordinates.size(); at += inputs) {
    outputs.push_back(f(coordinates.subspan(at, inputs)));
  }
  return outputs;
}

/// Returns the outputs of `f` at the points of the first `rows` rows of a design.
std::vector<double> outputs_of(const Function& f, decltype(saltelli_row)& design,
                               std::size_t inputs, std::uint64_t seed, std::uint64_t rows) {
  std::vector<double> outputs;
  for (std::uint64_t row = 0; row < rows; ++row) {
    const auto some = outputs_at(f, design(inputs, seed, row), inputs);
    outputs.insert(outputs.end(), some.begin(), some.end());
  }
  return outputs;
}

std::vector<double> sobol_outputs(const Function& f, std::size_t inputs, std::uint64_t seed,
                                  std::uint64_t rows) {
  return outputs_of(f, saltelli_row, inputs, seed, rows);
}

std::vector<double> morris_outputs(const Function& f, std::size_t inputs, std::uint64_t seed,
                                   std::uint64_t trajectories) {
  return outputs_of(f, morris_trajectory, inputs, seed, trajectories);
}

/// Returns the coordinates of the points of the first trajectories.
std::vector<double> morris_points(std::size_t inputs, std::uint64_t seed,
                                  std::uint64_t trajectories) {
  std::vector<double> points;
  for (std::uint64_t number = 0; number < trajectories; ++number) {
    const auto some = morris_trajectory(inputs, seed, number);
    points.insert(points.end(), some.begin(), some.end());
  }
  return points;
}

bool contains(const Estimate& estimate, double truth) {
  return estimate.from <= truth && truth <= estimate.to;
}

/// Checks that the intervals of seeds 1 ... 20 are narrow and that at most 5 % of them miss the
/// known indices.
void expect_known_indices(const KnownFunction& known, std::uint64_t rows, double half_width) {
  const std::size_t inputs = known.first.size();
  std::size_t intervals = 0;
  std::size_t misses = 0;
  const auto expect_index = [&](const Estimate& found, double truth) {
    ++intervals;
    misses += contains(found, truth) ? 0U : 1U;
    EXPECT_LT(found.half_width(), half_width);
  };
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto found = sobol_indices(sobol_outputs(known.f, inputs, seed, rows), inputs, seed);
    EXPECT_EQ(found.rows, rows);
    EXPECT_EQ(found.dropped, 0U);
    for (std::size_t i = 0; i < inputs; ++i) {
      expect_index(found.measures[0].of_inputs[i], known.first[i]);
      expect_index(found.measures[1].of_inputs[i], known.total[i]);
    }
  }
  EXPECT_LE(20 * misses, intervals);
}

TEST(SobolIndicesTest, ThoseOfIshigamiAreWithinTheirIntervals) {
  expect_known_indices(ishigami(), 2048, 0.08);
}

TEST(SobolIndicesTest, ThoseOfTheGFunctionAreWithinTheirIntervals) {
  expect_known_indices(g_function({0.0, 1.0, 4.5, 9.0, 99.0, 99.0}), 2048, 0.08);
}

TEST(SobolIndicesTest, IntervalsShrinkAsTheSquareRootOfTheRows) {
  const auto known = ishigami();
  const auto few = sobol_indices(sobol_outputs(known.f, 3, 1, 512), 3, 1);
  const auto many = sobol_indices(sobol_outputs(known.f, 3, 1, 8192), 3, 1);
  for (std::size_t measure = 0; measure < 2; ++measure) {
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(few.measures[measure].of_inputs[i].half_width() /
                      many.measures[measure].of_inputs[i].half_width(),
                  4.0, 0.8);
    }
  }
}

// Random rows satisfy the bootstrap's assumption, unlike Sobol's rows. So the intervals must miss
// about 5 % of the 2400 indices of 400 designs: 120. The limits of 50 and 260 are wide, because the
// indices of a design depend on each other.
TEST(SobolIndicesTest, IntervalsCoverTheIndicesOfRandomRowsAsOftenAsTheySay) {
  const auto known = ishigami();
  int misses = 0;
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    std::vector<double> outputs;
    for (std::uint64_t row = 0; row < 256; ++row) {
      // Row 0 of another scrambling is an independent random row.
      const auto some = outputs_at(known.f, saltelli_row(3, 1000 * seed + row, 0), 3);
      outputs.insert(outputs.end(), some.begin(), some.end());
    }
    const auto found = sobol_indices(outputs, 3, seed);
    for (std::size_t i = 0; i < 3; ++i) {
      misses += contains(found.measures[0].of_inputs[i], known.first[i]) ? 0 : 1;
      misses += contains(found.measures[1].of_inputs[i], known.total[i]) ? 0 : 1;
    }
  }
  EXPECT_GT(misses, 50);
  EXPECT_LT(misses, 260);
}

TEST(SobolIndicesTest, ARowWithAFailedPointIsDroppedWholeAndCounted) {
  const auto known = ishigami();
  auto outputs = sobol_outputs(known.f, 3, 1, 64);
  std::vector<double> without(outputs.begin() + 5, outputs.end());
  without.erase(without.begin() + 5 * 30, without.begin() + 5 * 31);
  outputs[3] = kNaN;                                          // the point A_B^2 of row 0
  outputs[5 * 31] = std::numeric_limits<double>::infinity();  // the point A of row 31
  const auto dropped = sobol_indices(outputs, 3, 1);
  const auto never = sobol_indices(without, 3, 1);
  EXPECT_EQ(dropped.rows, 62U);
  EXPECT_EQ(dropped.dropped, 2U);
  for (std::size_t i = 0; i < 3; ++i) {
    // The two calls subtract different constants, so sums round differently.
    EXPECT_NEAR(dropped.measures[0].of_inputs[i].value, never.measures[0].of_inputs[i].value,
                1e-12);
    EXPECT_NEAR(dropped.measures[1].of_inputs[i].to, never.measures[1].of_inputs[i].to, 1e-12);
  }
}

TEST(SobolIndicesTest, OutputsWithoutVarianceOrRowsHaveNoIndices) {
  const std::vector<double> same(5 * 16, 4909.4);
  const auto constant = sobol_indices(same, 3, 1);
  EXPECT_TRUE(std::isnan(constant.measures[0].of_inputs[0].value));
  EXPECT_TRUE(std::isnan(constant.measures[1].of_inputs[2].to));
  std::vector<double> rounded = same;
  for (std::size_t i = 0; i < rounded.size(); i += 3) {
    rounded[i] = std::nextafter(4909.4, 0.0);
  }
  const auto by_rounding = sobol_indices(rounded, 3, 1);
  EXPECT_TRUE(std::isnan(by_rounding.measures[0].of_inputs[0].value));
  EXPECT_TRUE(std::isnan(by_rounding.measures[1].of_inputs[2].to));
  const auto none = sobol_indices(std::vector<double>(5, kNaN), 3, 1);
  EXPECT_EQ(none.rows, 0U);
  EXPECT_EQ(none.dropped, 1U);
  ASSERT_EQ(none.measures[0].of_inputs.size(), 3U);
  EXPECT_TRUE(std::isnan(none.measures[1].of_inputs[0].value));
}

TEST(SaltelliDesignTest, ARowIsAAndBAndAWithEachCoordinateOfB) {
  const auto row = saltelli_row(2, 1, 5);
  ASSERT_EQ(row.size(), 8U);
  const std::vector<double> expected{row[0], row[1], row[2], row[3],
                                     row[2], row[1], row[0], row[3]};
  EXPECT_EQ(row, expected);
  EXPECT_EQ(std::set<double>(row.begin(), row.begin() + 4).size(), 4U);
  EXPECT_THROW(saltelli_row(kMaxSobolInputs + 1, 1, 0), std::out_of_range);
}

TEST(SaltelliDesignTest, TheFirstRowsOfAPowerOfTwoHaveOneCoordinateInEachStratum) {
  for (std::size_t coordinate = 0; coordinate < 2 * kMaxSobolInputs; ++coordinate) {
    std::set<int> strata;
    for (std::uint64_t number = 0; number < 64; ++number) {
      strata.insert(static_cast<int>(64.0 * saltelli_row(kMaxSobolInputs, 3, number)[coordinate]));
    }
    EXPECT_EQ(strata.size(), 64U) << coordinate;
  }
}

TEST(MorrisTest, TheEffectsOfALinearFunctionAreItsCoefficients) {
  const std::vector<double> slopes{3.0, -2.0, 0.0, 0.5};
  const auto linear = [&slopes](std::span<const double> u) {
    double sum = 10.0;
    for (std::size_t i = 0; i < u.size(); ++i) {
      sum += slopes[i] * u[i];
    }
    return sum;
  };
  const auto effects =
      morris_effects(morris_outputs(linear, 4, 7, 16), morris_points(4, 7, 16), 4, 7);
  EXPECT_EQ(effects.rows, 16U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(effects.measures[2].of_inputs[i].value, slopes[i], 1e-12);
    EXPECT_NEAR(effects.measures[0].of_inputs[i].value, std::abs(slopes[i]), 1e-12);
    EXPECT_NEAR(effects.measures[0].of_inputs[i].half_width(), 0.0, 1e-12);
    EXPECT_EQ(effects.measures[1].of_inputs[i].value, 0.0);
  }
}

TEST(MorrisTest, TheEffectsOfALinearFunctionAreItsCoefficientsAlsoOnUnevenLevels) {
  constexpr std::uint64_t kRows = 32;
  for (const std::vector<double>& levels :
       {std::vector{0.0, 1.0}, {0.0, 0.1, 1.0}, {1.0, 0.0, 0.7}, {0.0, 0.25, 0.5, 0.75, 1.0}}) {
    auto points = morris_points(2, 3, kRows);
    for (double& u : points) {
      u = levels[static_cast<std::size_t>(u * static_cast<double>(levels.size()))];
    }
    const auto outputs = outputs_at(
        [](std::span<const double> u) { return 5.0 + 3.0 * u[0] - 0.2 * u[1]; }, points, 2);
    const auto effects = morris_effects(outputs, points, 2, 3);
    EXPECT_NEAR(effects.measures[0].of_inputs[0].value, 3.0, 1e-12) << levels.size();
    EXPECT_NEAR(effects.measures[2].of_inputs[1].value, -0.2, 1e-12) << levels.size();
    EXPECT_NEAR(effects.measures[1].of_inputs[0].value, 0.0, 1e-12) << levels.size();
  }
}

TEST(MorrisTest, AnOutputThatVariesByRoundingErrorsHasNoEffects) {
  const auto nearly_constant = [](std::span<const double> u) { return 2.5 + 4e-16 * u[0]; };
  const auto effects =
      morris_effects(morris_outputs(nearly_constant, 2, 1, 16), morris_points(2, 1, 16), 2, 1);
  for (const Measure& measure : effects.measures) {
    EXPECT_EQ(measure.of_inputs[0].value, 0.0) << measure.name;
    EXPECT_EQ(measure.of_inputs[0].to, 0.0) << measure.name;
  }
}

// f = u1 (u2 - 1/2). The effect of u1 is u2 - 1/2, and its mean is 0. On the eight levels its
// variance is (8^2 - 1)/12/8^2, and the mean of its magnitude is 1/4.
TEST(MorrisTest, AnInteractionHasADeviationWhereItsMeanIsZero) {
  const auto product = [](std::span<const double> u) { return u[0] * (u[1] - 0.5); };
  const auto effects =
      morris_effects(morris_outputs(product, 2, 1, 4000), morris_points(2, 1, 4000), 2, 1);
  EXPECT_NEAR(effects.measures[2].of_inputs[0].value, 0.0, 0.02);
  EXPECT_NEAR(effects.measures[0].of_inputs[0].value, 0.25, 0.01);
  EXPECT_NEAR(effects.measures[1].of_inputs[0].value, std::sqrt(63.0 / 768.0), 0.01);
  EXPECT_NEAR(effects.measures[2].of_inputs[1].value, 0.5, 0.02);
  EXPECT_LT(effects.measures[0].of_inputs[0].from, 0.25);
  EXPECT_GT(effects.measures[0].of_inputs[0].to, 0.25);
}

TEST(MorrisTest, EachInputChangesOnceByHalfTheCubeAndTakesAllLevels) {
  constexpr std::size_t kInputs = 20;  // more inputs than Saltelli's design allows
  std::set<double> levels;
  for (std::uint64_t number = 0; number < 64; ++number) {
    const auto points = morris_trajectory(kInputs, 2, number);
    ASSERT_EQ(points.size(), (kInputs + 1) * kInputs);
    std::set<std::size_t> changed;
    for (std::size_t i = 0; i < kInputs * kInputs; ++i) {
      if (points[i + kInputs] != points[i]) {
        EXPECT_EQ(std::abs(points[i + kInputs] - points[i]), 0.5);
        changed.insert(i % kInputs);
      }
      levels.insert(points[i]);
    }
    EXPECT_EQ(changed.size(), kInputs);
  }
  EXPECT_EQ(levels.size(), 8U);
  EXPECT_EQ(*levels.begin(), 1.0 / 16.0);
}

TEST(MorrisTest, ATrajectoryWithAFailedPointIsDroppedAndOneAloneHasNoEffects) {
  const auto f = [](std::span<const double> u) { return u[0] + u[1]; };
  auto outputs = morris_outputs(f, 2, 1, 3);
  outputs[4] = kNaN;
  const auto two = morris_effects(outputs, morris_points(2, 1, 3), 2, 1);
  EXPECT_EQ(two.rows, 2U);
  EXPECT_EQ(two.dropped, 1U);
  EXPECT_NEAR(two.measures[2].of_inputs[1].value, 1.0, 1e-12);
  outputs[0] = kNaN;
  EXPECT_TRUE(std::isnan(
      morris_effects(outputs, morris_points(2, 1, 3), 2, 1).measures[0].of_inputs[0].value));
}

}  // namespace
}  // namespace oblique::client
