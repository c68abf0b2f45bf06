#include "proto/recipe/point_inputs.h"

#include <cmath>
#include <limits>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/recipes.h"

namespace oblique::protocol {
namespace {

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

TEST(PointInputs, OfEveryPointAreThoseOfItsStudy) {
  const PointTable table = table_of_lengths();
  for (std::uint64_t i = 0; i < table.size(); ++i) {
    const PointResult result = result_of(i, table);
    EXPECT_THAT(fault_of_inputs(result, table), IsEmpty());
    const Point point = inputs_of(result, table);
    EXPECT_EQ(point.model, table.point(i).model);
    EXPECT_EQ(point.mu, table.point(i).mu);
  }
}

TEST(PointInputs, MayDifferInTheLastBitsAndAreKeptAsTheyWereSent) {
  const PointTable table = table_of_lengths();
  PointResult result = result_of(3, table);
  const double H_m = std::nextafter(result.h_m(), 1.0);
  result.set_h_m(H_m);
  result.set_mu(result.mu() * (1.0 - 0.9e-12));
  result.mutable_model()->set_e_pa(result.model().e_pa() * (1.0 + 0.9e-12));
  EXPECT_THAT(fault_of_inputs(result, table), IsEmpty());
  EXPECT_EQ(inputs_of(result, table).H_m, H_m);
}

TEST(PointInputs, ThatDifferByMoreAreAFault) {
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
  EXPECT_THAT(fault_of_inputs(result, table), HasSubstr("mu")) << "the study has 0";
}

TEST(PointInputs, OfTheModelAreWholeNumbersAndLengthsToo) {
  const PointTable table = table_of_lengths();
  PointResult result = result_of(3, table);
  result.mutable_model()->set_elements_per_link(result.model().elements_per_link() + 1);
  EXPECT_THAT(fault_of_inputs(result, table), HasSubstr("another model"));
  result = result_of(3, table);
  result.mutable_model()->set_integrator(77);
  EXPECT_THAT(fault_of_inputs(result, table), HasSubstr("another model"));
  result = result_of(3, table);
  result.mutable_model()->add_lengths_m(0.1);
  EXPECT_THAT(fault_of_inputs(result, table), HasSubstr("another model"));
}

TEST(PointInputs, OfAStudyThatHasGrownByModelsSinceAreThoseOfItsPoint) {
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
  EXPECT_EQ(inputs_of(result, table).mu, table.point(3).mu) << "the study's own";
}

}  // namespace
}  // namespace oblique::protocol
