#include "proto/recipe/point_table.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "tests/support/recipes.h"

namespace oblique::protocol {
namespace {

/// Returns a study with several blocks, listed and ranged axes, and model axes in two blocks.
Recipe varied_recipe() {
  Recipe recipe = recipe_of({
      {listed("H", {0.96, 1.0, 1.04}), listed("mu", {0.4, 0.8}), range("e", 0.5, 1.0, 6)},
      {listed("k", {1e7, 2e7, 3e7}), listed("elements_per_link", {4, 8}), range("H", 0.9, 1.1, 5),
       listed("mu", {0.1}), listed("e", {1.0, 0.6})},
      {listed("H", {1.0}), range("mu", 0.0, 2.0, 9), listed("e", {0.7})},
      {range("eta2", 1.2, 1.4, 3), listed("H", {1.0}), listed("mu", {0.4}), listed("e", {1.0})},
  });
  *recipe.mutable_model() = to_message(solver::preset("printed"));
  return recipe;
}

struct ExpectedPoint {
  solver::ModelParameters model = solver::preset("printed");
  double H_m;
  double mu;
  double e_star;
};

/// Appends the points of a block to `points` by nested loops over its axes. The first axis is the
/// outermost loop.
void enumerate(const Block& block, int depth, ExpectedPoint current,
               std::vector<ExpectedPoint>& points) {
  if (depth == block.axes_size()) {
    points.push_back(current);
    return;
  }
  const Axis& axis = block.axes(depth);
  for (std::uint64_t i = 0; i < axis_size(axis); ++i) {
    const double value = axis_value(axis, i);
    if (axis.key() == "H") {
      current.H_m = value;
    } else if (axis.key() == "mu") {
      current.mu = value;
    } else if (axis.key() == "e") {
      current.e_star = value;
    } else {
      solver::find_model_key(axis.key())->set(current.model, value);
    }
    enumerate(block, depth + 1, current, points);
  }
}

TEST(PointTableTest, PointsAreThoseOfNestedLoopsOverTheAxes) {
  const PointTable table(varied_recipe());
  std::vector<ExpectedPoint> expected;
  for (const Block& block : table.recipe().blocks()) {
    enumerate(block, 0, {}, expected);
  }
  ASSERT_EQ(table.size(), expected.size());
  for (std::uint64_t i = 0; i < table.size(); ++i) {
    const Point point = table.point(i);
    EXPECT_EQ(point.H_m, expected[i].H_m) << "point " << i;
    EXPECT_EQ(point.mu, expected[i].mu) << "point " << i;
    EXPECT_EQ(point.e_star, expected[i].e_star) << "point " << i;
    EXPECT_EQ(table.model(point.model), expected[i].model) << "point " << i;
  }
}

TEST(PointTableTest, ASegmentIsTheLongestRunOfPointsWithOneModel) {
  const PointTable table(varied_recipe());
  int segments = 0;
  for (std::uint64_t next = 0; next < table.size(); ++segments) {
    const Segment segment = table.segment_at(next);
    ASSERT_EQ(segment.first_point, next);
    ASSERT_GT(segment.count, 0U);
    for (; next < segment.first_point + segment.count; ++next) {
      EXPECT_EQ(table.point(next).model, segment.model);
      EXPECT_EQ(table.segment_at(next).first_point, segment.first_point);
    }
  }
  EXPECT_EQ(segments, 1 + 6 + 1 + 3);
}

TEST(PointTableTest, AdjacentBlocksThatShareAModelAreOneSegment) {
  const std::vector<Axis> point{listed("H", {1.0}), listed("mu", {0.4}), listed("e", {1.0})};
  const std::vector<Axis> two{listed("H", {0.9, 1.0}), listed("mu", {0.4}), listed("e", {1.0})};
  std::vector<Axis> other_model = two;
  other_model.insert(other_model.begin(), listed("k", {1e7}));
  const PointTable table(recipe_of({point, two, point, other_model, other_model, two, two, point}));
  using Run = std::tuple<std::uint64_t, std::uint64_t, std::uint64_t>;
  for (const auto& [model, first_point, count] :
       {Run{0, 0, 4}, Run{1, 4, 2}, Run{2, 6, 2}, Run{0, 8, 5}}) {
    for (std::uint64_t i = first_point; i < first_point + count; ++i) {
      const Segment segment = table.segment_at(i);
      EXPECT_EQ((Run{segment.model, segment.first_point, segment.count}),
                (Run{model, first_point, count}));
    }
  }
  EXPECT_THROW(table.segment_at(13), std::out_of_range);
}

TEST(PointTableTest, AnyPointOfATrillionCanBeComputed) {
  const PointTable table(recipe_of({{range("H", 0.5, 1.1, 10'000), range("mu", 0.0, 1.0, 10'000),
                                     range("e", 0.5, 1.0, 10'000)}}));
  ASSERT_EQ(table.size(), kMaxPoints);
  const Point last = table.point(table.size() - 1);
  EXPECT_EQ(std::tuple(last.H_m, last.mu, last.e_star), std::tuple(1.1, 1.0, 1.0));
  // 123'456'789'012 = 1234 · 10^8 + 5678 · 10^4 + 9012
  const Point inner = table.point(123'456'789'012);
  EXPECT_EQ(inner.H_m, axis_value(table.recipe().blocks(0).axes(0), 1234));
  EXPECT_EQ(inner.mu, axis_value(table.recipe().blocks(0).axes(1), 5678));
  EXPECT_EQ(inner.e_star, axis_value(table.recipe().blocks(0).axes(2), 9012));
}

TEST(PointTableTest, AnyModelOfABillionCanBeComputedAndNoneBeyond) {
  const PointTable table(recipe_of({{range("k", 1e7, 3e7, 1'000'000'001), listed("H", {1.0}),
                                     listed("mu", {0.4}), listed("e", {1.0})}}));
  EXPECT_EQ(table.models(), 1'000'000'001U);
  EXPECT_EQ(table.model(500'000'000).k_N_m, 2e7);
  EXPECT_EQ(table.point(500'000'000).model, 500'000'000U);
  EXPECT_THROW(table.point(table.size()), std::out_of_range);
  EXPECT_THROW(table.values(table.size()), std::out_of_range);
  EXPECT_THROW(table.segment_at(table.size()), std::out_of_range);
  EXPECT_THROW(table.model(table.models()), std::out_of_range);
}

using testing::HasSubstr;
using testing::IsEmpty;

PointTable table_of_lengths() {
  return PointTable(recipe_of({{range("length", 0.3, 0.4, 3), listed("H", {0.8}),
                                listed("mu", {0.0, 0.4}), listed("e", {0.9})}}));
}

PointResult result_of(std::uint64_t point, const PointTable& table) {
  PointResult result;
  result.set_point(point);
  set_inputs(result, table);
  return result;
}

TEST(PointInputs, MayDifferInTheLastBitsAndAreStoredAsSent) {
  const PointTable table = table_of_lengths();
  PointResult result = result_of(3, table);
  EXPECT_THAT(fault_of_inputs(result, table), IsEmpty());
  const double H_m = std::nextafter(result.h_m(), 1.0);
  result.set_h_m(H_m);
  result.set_mu(result.mu() * (1.0 - 0.9e-12));
  result.mutable_model()->set_e_pa(result.model().e_pa() * (1.0 + 0.9e-12));
  EXPECT_THAT(fault_of_inputs(result, table), IsEmpty());
  EXPECT_EQ(inputs_of(result, table).H_m, H_m);
}

TEST(PointInputs, ThatDifferByMoreThanTheLastBitsAreRefused) {
  const PointTable table = table_of_lengths();
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  for (const double factor : {1.0 + 1.2e-12, 1.0 - 1.2e-12, -1.0, 0.0, kNaN, kInfinite}) {
    PointResult result = result_of(3, table);
    result.set_h_m(result.h_m() * factor);
    EXPECT_THAT(fault_of_inputs(result, table), HasSubstr("with H = ")) << factor;
    result = result_of(3, table);
    result.set_e_star(result.e_star() * factor);
    EXPECT_THAT(fault_of_inputs(result, table), HasSubstr("with e = ")) << factor;
    result = result_of(3, table);
    result.mutable_model()->set_lengths_m(1, result.model().lengths_m(1) * factor);
    EXPECT_THAT(fault_of_inputs(result, table), HasSubstr("another model")) << factor;
  }
  PointResult result = result_of(2, table);
  result.set_mu(1e-300);
  EXPECT_THAT(fault_of_inputs(result, table), HasSubstr("mu"))
      << "the point of the study has mu = 0";
}

TEST(PointInputs, IncludeWholeNumbersAndLengthsOfTheModel) {
  const PointTable table = table_of_lengths();
  for (void (*change)(ModelParameters&) :
       {+[](ModelParameters& m) { m.set_elements_per_link(m.elements_per_link() + 1); },
        +[](ModelParameters& m) { m.set_integrator(77); },
        +[](ModelParameters& m) { m.add_lengths_m(0.1); }}) {
    PointResult result = result_of(3, table);
    change(*result.mutable_model());
    EXPECT_THAT(fault_of_inputs(result, table), HasSubstr("another model"));
  }
}

TEST(PointInputs, AreAlsoComparedInTheTextsOfModels) {
  const std::string own = canonical_model(solver::preset("paper"));
  const auto with = [&](const std::string& part, const std::string& other) {
    return std::string(own).replace(own.find(part), part.size(), other);
  };
  for (const std::string& close :
       {own, with("=0.4,0.4,", "=0.4,0.4000000000000001,"), with("rho=2700", "rho=2700.0")}) {
    EXPECT_TRUE(is_close(close, own)) << close;
  }
  for (const std::string& other :
       {std::string(), std::string("oblique-model-1"), own + " k=1", own.substr(0, own.size() - 1),
        with("rho=2700", "rho=2701"), with("explicit", "euler"), with("0.4,0.4,", "0.4,"),
        with("k=2.7e+07", "k=nan")}) {
    EXPECT_FALSE(is_close(other, own)) << other;
  }
}

TEST(PointInputs, StayValidWithoutAModelAfterTheStudyGrewByModels) {
  const Axis H = listed("H", {0.8});
  const Axis mu = listed("mu", {0.0, 0.4});
  const Axis e = listed("e", {0.9});
  const PointTable before(recipe_of({{H, mu, e}}));
  const PointTable grown(recipe_of({{H, mu, e}, {range("length", 0.3, 0.4, 3), H, mu, e}}));
  EXPECT_THAT(fault_of_inputs(result_of(1, before), grown), IsEmpty());
}

TEST(PointInputs, MayBeMissingOnlyInAFailedPoint) {
  const PointTable table = table_of_lengths();
  PointResult result = result_of(3, table);
  result.clear_model();
  EXPECT_THAT(fault_of_inputs(result, table), HasSubstr("another model"));
  result = result_of(3, table);
  result.clear_mu();
  EXPECT_THAT(fault_of_inputs(result, table), HasSubstr("with mu = "));
  result.clear_h_m();
  EXPECT_THAT(fault_of_inputs(result, table), HasSubstr("with H = "));
  result.set_error("it never fell");
  EXPECT_THAT(fault_of_inputs(result, table), IsEmpty());
  EXPECT_EQ(inputs_of(result, table).mu, table.point(3).mu)
      << "missing inputs are taken from the study";
}

using testing::AllOf;
using testing::Each;
using testing::Ge;
using testing::Le;

const Axis kSomeH = listed("H", {0.9});
const Axis kSomeMu = listed("mu", {0.4});
const Axis kSomeE = listed("e", {1.0});

StudySize size_of_blocks(const std::vector<Block>& blocks) {
  return size_of(PointTable(recipe_of_blocks(blocks)));
}

TEST(StudySize, CountsDifferentFallsExactlyUpToAHundredThousandPoints) {
  const auto drawn = size_of_blocks(
      {sampled({uniform("E", 6e10, 8e10), uniform("k", 1e7, 1e8), kSomeH, kSomeMu, kSomeE},
               SAMPLE_SOBOL, 100'000)});
  EXPECT_EQ(drawn.falls, 100'000U) << "each value of E needs its own fall";
  EXPECT_FALSE(drawn.falls_estimated);
  const auto several = size_of_blocks({sampled(
      {range("E", 6e10, 8e10, 21), uniform("k", 1e7, 1e8), kSomeH, uniform("mu", 0.1, 1), kSomeE},
      SAMPLE_LATIN_HYPERCUBE, 20'000)});
  EXPECT_EQ(several.models, 20'000U);
  EXPECT_EQ(several.falls, 21U) << "k acts only in contact";
}

TEST(StudySize, CountsNoFallOfPointsThatAFilterLeavesOut) {
  const auto size = size_of_blocks(
      {filtered({range("E", 6e10, 8e10, 21), kSomeH, kSomeMu, kSomeE}, "E > 7.45e10")});
  EXPECT_EQ(size.points, 6U);
  EXPECT_EQ(size.falls, 6U);
  EXPECT_THAT(size.examples, Each(AllOf(Ge(15U), Le(20U))));
}

// A third of 10^4 examined points pass the filter. The tolerance of this share, 0.02, is four
// standard deviations.
TEST(StudySize, EstimatesThePointsThatPassAFilterInALargeStudy) {
  const Block plain = filtered({kSomeH, range("mu", 0.0, 1.0, 1'000), kSomeE}, "");
  const Block large = filtered({kSomeH, range("mu", 0.0, 3.0, 3'000'000), kSomeE}, "mu < 1");
  const auto size = size_of_blocks({plain, large});
  EXPECT_TRUE(size.points_estimated);
  EXPECT_NEAR(static_cast<double>(size.points), 1'001'000.0, 0.02 * 3e6);
  const auto counted =
      size_of_blocks({plain, filtered({kSomeH, kSomeMu, listed("e", {0.5, 1})}, "e > 0.6")});
  EXPECT_FALSE(counted.points_estimated);
  EXPECT_EQ(counted.points, 1'001U);
}

// The tolerance of 400 falls is more than four standard deviations of the estimated number.
TEST(StudySize, EstimatesTheFallsOfALargeStudyFromTenThousandPoints) {
  const auto shared = size_of_blocks(
      {filtered({range("E", 6e10, 8e10, 5'000), kSomeH, range("mu", 0.1, 1, 40), kSomeE}, "")});
  EXPECT_TRUE(shared.falls_estimated);
  EXPECT_NEAR(static_cast<double>(shared.falls), 5'000.0, 400.0);
  const auto known = size_of_blocks({filtered(
      {listed("E", {6e10, 7e10, 8e10}), kSomeH, range("mu", 0.1, 1, 100'000), kSomeE}, "")});
  EXPECT_EQ(known.falls, 3U);
  EXPECT_FALSE(known.falls_estimated) << "each fall occurred many times, so the count is exact";
  EXPECT_EQ(known.examples.size(), 64U);
  const auto drawn = size_of_blocks(
      {sampled({uniform("E", 6e10, 8e10), kSomeH, kSomeMu, kSomeE}, SAMPLE_RANDOM, 1'000'000'000)});
  EXPECT_TRUE(drawn.falls_estimated);
  EXPECT_EQ(drawn.falls, 1'000'000'000U);
}

TEST(StudySize, CountsAResultForEachPointAndEachModel) {
  EXPECT_EQ(size_of_blocks({filtered({kSomeH, range("mu", 0.1, 1, 100), kSomeE}, "")}).bytes,
            100U * 970 + 600);
  EXPECT_EQ(
      size_of_blocks({filtered({range("k", 1e7, 2e7, 100), kSomeH, kSomeMu, kSomeE}, "")}).bytes,
      100U * (970 + 600));
}

}  // namespace
}  // namespace oblique::protocol
