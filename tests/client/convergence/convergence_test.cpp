#include "client/convergence/convergence.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "worker/solver/model/parameters.h"
#include "worker/solver/model/result_fields.h"
#include "worker/solver/solve.h"

namespace oblique::client {
namespace {

using solver::CaseResult;

constexpr double kNoRounding = 0.0;

// Returns the values limit + c h^p for h = 1, 1/2, 1/4, ...
std::vector<double> sequence(double limit, double c, double p, int values) {
  std::vector<double> all;
  for (int i = 0; i < values; ++i) {
    all.push_back(limit + c * std::exp2(-p * i));
  }
  return all;
}

TEST(Richardson, FindsOrderLimitAndErrorOfAPureErrorTermExactly) {
  for (const double order : {0.5, 1.0, 2.0, 3.7}) {
    auto values = sequence(7.0, -3.0, order, 4);
    values.insert(values.begin(), 1000.0);  // ignored: only the last three values count
    const auto found = extrapolate(values, 4.0, kNoRounding);
    EXPECT_EQ(found.trend, Trend::kMonotone);
    EXPECT_NEAR(found.order.value(), order, 1e-12);
    EXPECT_NEAR(found.limit, 7.0, 1e-12);
    EXPECT_NEAR(found.error.value(), 7.0 - values.back(), 1e-12);
  }
}

TEST(Richardson, ErrorEstimateIsRightToLeadingOrderWhenAHigherTermIsPresent) {
  // v(h) = 2 + h^2 + h^3. At the smallest step, 1/64, the third term is 1/64 of the second.
  std::vector<double> values;
  for (const double h : {1.0 / 16, 1.0 / 32, 1.0 / 64}) {
    values.push_back(2.0 + h * h + h * h * h);
  }
  const auto found = extrapolate(values, 4.0, kNoRounding);
  const double error = values.back() - 2.0;
  EXPECT_NEAR(found.error.value(), error, 0.1 * error);
  EXPECT_NEAR(found.order.value(), 2.0, 0.1);
}

TEST(Richardson, DoesNotTrustALastDifferenceThatIsSmallByChance) {
  // The differences 16 and 1e-6 give order 24, which a method of order 2 cannot have.
  const std::vector<double> values{0.0, 16.0, 16.000001};
  const auto found = extrapolate(values, 2.0, kNoRounding);
  EXPECT_GT(found.order.value(), 20.0);
  EXPECT_DOUBLE_EQ(found.error.value(), 16.0 / 4.0 / 3.0);
}

TEST(Richardson, ExtrapolatesOnlyMonotoneValues) {
  struct {
    std::vector<double> values;
    double resolution;
    Trend trend;
    std::optional<double> error;
  } const cases[]{{{0.0, 8.0, 6.0}, 0.0, Trend::kOscillating, 2.0},
                  {{0.0, 1.0, 2.0}, 0.0, Trend::kUnsettled, 1.0},
                  {{1.0, 1.0 + 1e-12, 1.0 - 1e-12}, 1e-11, Trend::kRounding, 1e-11},
                  {{0.0, 0.0, 0.0}, 0.0, Trend::kRounding, 0.0},
                  {{1.0, 3.0}, 0.0, Trend::kTooFew, 2.0},
                  {{1.0}, 0.0, Trend::kTooFew, std::nullopt}};
  for (const auto& [values, resolution, trend, error] : cases) {
    const auto found = extrapolate(values, 4.0, resolution);
    EXPECT_EQ(found.trend, trend) << testing::PrintToString(values);
    EXPECT_EQ(found.error, error) << testing::PrintToString(values);
    EXPECT_EQ(found.limit, values.back()) << testing::PrintToString(values);
    EXPECT_FALSE(found.order) << testing::PrintToString(values);
  }
}

using Kind = ContactChange::Kind;
using solver::PhaseKind;

// A contact that ends at 100 us, with alternating force peaks and valleys at `turns_us`.
CaseResult with_turns(const std::vector<double>& turns_us) {
  CaseResult result{};
  double start_s = 0.0;
  for (std::size_t i = 0; i <= turns_us.size(); ++i) {
    const double end_s = (i < turns_us.size() ? turns_us[i] : 100.0) * 1e-6;
    const bool compression = i % 2 == 0;
    result.phases.push_back(
        {compression ? PhaseKind::kCompression : PhaseKind::kRestitution, start_s, end_s, 0.0});
    if (compression) {
      result.peaks.push_back({end_s, 1000.0, 0.0, true});
    }
    start_s = end_s;
  }
  result.duration_s = start_s;
  return result;
}

CaseResult with_sticks(const std::vector<solver::StickInterval>& sticks) {
  auto result = with_turns({50.0});
  result.stick_intervals = sticks;
  return result;
}

TEST(UnmatchedPairs, AreChosenSoThatTheOtherTimesAgreeBest) {
  using Pairs = std::vector<std::size_t>;
  EXPECT_EQ(lone_pairs({}, {}), Pairs{});
  EXPECT_EQ(lone_pairs({1.0, 2.0, 3.0}, {1.1, 2.1, 3.1}), Pairs{});
  EXPECT_EQ(lone_pairs({1.0, 5.0, 5.1, 9.0}, {1.0, 9.0}), Pairs{1});
  EXPECT_EQ(lone_pairs({1.0, 1.1, 5.0}, {5.0}), Pairs{0});
  EXPECT_EQ(lone_pairs({1.0, 5.0, 5.1}, {1.0}), Pairs{1});
  EXPECT_EQ(lone_pairs({1.0, 1.1, 3.0, 5.0, 5.1}, {3.0}), (Pairs{0, 3}));
  EXPECT_EQ(lone_pairs({1.0, 2.0, 3.0, 4.0}, {}), (Pairs{0, 2}));
  EXPECT_EQ(lone_pairs({1.0, 4.0, 6.0, 8.0}, {4.0, 6.0}), Pairs{0})
      << "only adjacent events are removed";
  EXPECT_THROW(lone_pairs({1.0, 2.0}, {1.0}), std::invalid_argument);
  EXPECT_THROW(lone_pairs({1.0}, {1.0, 2.0, 3.0}), std::invalid_argument);
}

TEST(ContactChanges, AreNoneIfOnlyTimesDiffer) {
  EXPECT_TRUE(changes_between(with_turns({20, 50, 80}), with_turns({22, 57, 79})).empty());
  EXPECT_TRUE(
      changes_between(with_sticks({{1e-5, 2e-5}}), with_sticks({{1.2e-5, 2.2e-5}})).empty());
}

TEST(ContactChanges, FindEventsThatOnlyOneLevelHas) {
  auto ripple = with_turns({20, 50, 60});
  ripple.peaks[1].major = false;
  struct {
    CaseResult coarser;
    CaseResult finer;
    ContactChange change;
  } const cases[]{
      {with_turns({20}), with_turns({20, 60, 62}), {Kind::kCompression, 60e-6, 62e-6, true}},
      {with_turns({20, 21, 30, 50, 80}),
       with_turns({31, 51, 80}),
       {Kind::kRestitution, 20e-6, 21e-6, false}},
      {with_sticks({{0.0, 3e-5}}),
       with_sticks({{0.0, 3.1e-5}, {9e-5, 1e-4}}),
       {Kind::kStick, 9e-5, 1e-4, true}},
      {with_sticks({{0.0, 5e-5}}),
       with_sticks({{0.0, 2e-5}, {2.1e-5, 5e-5}}),
       {Kind::kSlip, 2e-5, 2.1e-5, true}},
      {with_turns({20, 50, 60}), ripple, {Kind::kRipple, 60e-6, 60e-6, false}}};
  for (const auto& [coarser, finer, change] : cases) {
    const auto changes = changes_between(coarser, finer);
    ASSERT_EQ(changes.size(), 1U) << name_of(change.kind);
    EXPECT_EQ(changes[0].kind, change.kind);
    EXPECT_DOUBLE_EQ(changes[0].t0_s, change.t0_s);
    EXPECT_DOUBLE_EQ(changes[0].t1_s, change.t1_s);
    EXPECT_EQ(changes[0].in_finer, change.in_finer) << name_of(change.kind);
  }
  EXPECT_EQ(described(cases[0].change),
            "a compression of 2 us, from 60.00 to 62.00 us (V_n grazes 0)");
}

constexpr double kHighestOrder = 4.0;

// An invented contact with two peaks. Each output at step h is its limit times 1 + h^2.
CaseResult second_order(double h) {
  const double factor = 1.0 + h * h;
  CaseResult result{};
  result.fn_peak_N = 4000.0 * factor;
  result.ft_peak_N = 2000.0 * factor;
  result.peaks = {{1e-5, 4000.0 * factor, 2000.0 * factor, true},
                  {3e-5, 1000.0 * factor, 500.0 * factor, true}};
  result.mode = "SC SR sR sC sR";
  result.major_mode = result.mode;
  result.duration_s = 5e-4 * factor;
  result.stick_total_s = 1e-4 * factor;
  result.slide_m = 1e-3 * factor;
  result.impulse_n_Ns = 1.0 * factor;
  result.impulse_t_Ns = 0.4 * factor;
  result.vt_in_m_s = -5.0;
  result.vn_in_m_s = -5.0;
  result.vt_out_m_s = -1.0 * factor;
  result.vn_out_m_s = 2.0 * factor;
  result.reaction_peaks = {{1e-5, 900.0 * factor}, {2e-5, 700.0 * factor}};
  return result;
}

const OutputConvergence& named(const PointConvergence& point, const std::string& name) {
  return *std::find_if(point.outputs.begin(), point.outputs.end(),
                       [&](const auto& output) { return output.name == name; });
}

TEST(Outputs, HaveOneOutputPerMajorPeakWithoutRipples) {
  auto result = second_order(0.0);
  result.peaks.insert(result.peaks.begin() + 1, {2e-5, 3900.0, 1900.0, false});
  std::vector<std::string> names;
  for (const auto& output : outputs_of(result)) {
    names.push_back(output.name);
    EXPECT_TRUE(!output.name.starts_with("major_peak") || solver::find_result_column(output.name))
        << "the output has no column of that name";
  }
  EXPECT_EQ(names, (std::vector<std::string>{"fn_peak_N", "major_peak_1_N", "major_peak_2_N",
                                             "ft_peak_N", "duration_s", "stick_total_s", "slide_m",
                                             "impulse_n_Ns", "impulse_t_Ns", "vt_out_m_s",
                                             "vn_out_m_s", "reaction_0_N", "reaction_1_N"}));
}

TEST(Outputs, AreComparableUntilTheModesDiffer) {
  const auto outputs = outputs_of(second_order(0.0));
  const auto mode_of = [&](const std::string& name) {
    return std::find_if(outputs.begin(), outputs.end(),
                        [&](const Output& output) { return output.name == name; })
        ->mode;
  };
  EXPECT_EQ(mode_of("major_peak_1_N"), "SC SR");
  EXPECT_EQ(mode_of("ft_peak_N"), "SC SR sR");
  EXPECT_EQ(mode_of("major_peak_2_N"), "SC SR sR sC sR");
  EXPECT_EQ(mode_of("duration_s"), "SC SR sR sC sR");
}

TEST(Convergence, FindsOrderAndLimitOfEveryOutput) {
  const std::vector<CaseResult> results{second_order(0.1), second_order(0.05), second_order(0.025)};
  const auto point = convergence_of(results, kHighestOrder);
  const auto limits = outputs_of(second_order(0.0));
  EXPECT_TRUE(point.has_one_mode);
  EXPECT_TRUE(point.changes.empty());
  ASSERT_EQ(point.outputs.size(), limits.size());
  for (std::size_t i = 0; i < limits.size(); ++i) {
    const auto& found = point.outputs[i].extrapolation;
    EXPECT_NEAR(found.order.value(), 2.0, 1e-6) << limits[i].name;
    EXPECT_NEAR(found.limit, limits[i].value, 1e-9 * std::abs(limits[i].value)) << limits[i].name;
  }
}

TEST(Convergence, ComparesAnOutputOnlyIfTheModesBeforeItAgree) {
  // On the coarsest mesh the contact ends after one peak.
  auto coarsest = second_order(0.2);
  coarsest.major_mode = "SC SR sR";
  coarsest.peaks.pop_back();
  const std::vector<CaseResult> results{coarsest, second_order(0.1), second_order(0.05),
                                        second_order(0.025)};
  const auto point = convergence_of(results, kHighestOrder);
  EXPECT_TRUE(point.has_one_mode);
  EXPECT_TRUE(named(point, "major_peak_1_N").values[0]);
  EXPECT_FALSE(named(point, "major_peak_2_N").values[0]);
  EXPECT_FALSE(named(point, "duration_s").values[0]);
  EXPECT_NEAR(named(point, "duration_s").extrapolation.order.value(), 2.0, 1e-6);
}

TEST(Convergence, IsNotReachedIfTheModeChangesOnTheFinestLevels) {
  auto middle = second_order(0.05);
  middle.major_mode = "SC SR sR";
  middle.peaks.pop_back();
  const std::vector<CaseResult> results{second_order(0.1), middle, second_order(0.025)};
  const auto point = convergence_of(results, kHighestOrder);
  EXPECT_FALSE(point.has_one_mode);
  EXPECT_EQ(named(point, "duration_s").extrapolation.trend, Trend::kTooFew);
  EXPECT_EQ(named(point, "major_peak_1_N").extrapolation.trend, Trend::kMonotone);
}

TEST(MeshLevels, DoubleTheMeshAndChooseStepsForEach) {
  solver::ModelParameters model = solver::preset("paper");
  model.dt_s = 1e-6;
  model.dt_fall_s = 1e-6;
  const auto levels = mesh_levels(model, 2, 8);
  ASSERT_EQ(levels.size(), 3U);
  EXPECT_EQ(levels[2].name, "n = 8");
  EXPECT_EQ(levels[1].model.elements_per_link, 4);
  EXPECT_EQ(levels[1].model.dt_s, 0.0);
  EXPECT_EQ(levels[2].model.dt_fall_s, 0.0);
  for (const auto& [coarsest, finest] : {std::pair{4, 24}, {4, 8}, {0, 8}}) {
    EXPECT_THROW(mesh_levels(model, coarsest, finest), solver::InputError);
  }
  model.integrator = solver::Integrator::kGeneralizedAlpha;
  EXPECT_EQ(mesh_levels(model, 2, 8)[2].model.dt_s, 1e-6)
      << "steps of generalized-alpha do not depend on the mesh";
}

TEST(StepLevels, StartAtTheShortestStepOfTheModelAndHalveBothSteps) {
  const auto levels = step_levels({}, 0.2, 2);
  ASSERT_EQ(levels.size(), 3U);
  EXPECT_EQ(levels[1].name, "dt/2");
  EXPECT_DOUBLE_EQ(levels[1].model.dt_s, levels[0].model.dt_s / 2.0);
  // At e* = 0.2 restitution is stiffer than compression and needs shorter steps.
  EXPECT_LT(levels[0].model.dt_s, step_levels({}, 1.0, 2)[0].model.dt_s);
  solver::ModelParameters model = solver::preset("paper");
  model.dt_fall_s = 2e-6;
  EXPECT_EQ(step_levels(model, 1.0, 2)[2].model.dt_fall_s, 0.5e-6);
  model.integrator = solver::Integrator::kGeneralizedAlpha;
  model.dt_fall_s = 0.0;
  const auto implicit = step_levels(model, 1.0, 2);
  EXPECT_DOUBLE_EQ(implicit[2].model.dt_fall_s, implicit[0].model.dt_fall_s / 4.0);
  EXPECT_EQ(implicit[2].model.tolerance, model.tolerance);
}

TEST(StepLevels, ShareTheFallIfTheToleranceControlsItsSteps) {
  solver::ModelParameters model = solver::preset("paper");
  model.tolerance = 1e-4;
  const auto levels = step_levels(model, 1.0, 2);
  for (const auto& level : levels) {
    EXPECT_EQ(solver::fall_model(level.model), solver::fall_model(model));
  }
  const auto exact = exact_fall_level(levels[0]);
  ASSERT_TRUE(exact);
  EXPECT_EQ(exact->model.dt_s, levels[0].model.dt_s);
  EXPECT_DOUBLE_EQ(exact->model.tolerance, 1e-6) << "a tenth of the tolerance of the fall";
  EXPECT_NO_THROW(solver::validate(exact->model));
  model.tolerance = 1e-9;
  EXPECT_FALSE(exact_fall_level({"dt", model})) << "no tolerance is smaller";
  model.dt_fall_s = 2e-6;
  EXPECT_FALSE(exact_fall_level({"dt", model})) << "its step is halved";
}

TEST(FallSentence, NamesTheOutputThatTheFallChangesMost) {
  Refinement step{.what = "step", .levels = {}, .convergence = {}};
  step.levels.push_back({.level = {"dt", {}}, .result = second_order(0.0), .wall_s = 0.0});
  SolvedLevel exact{.level = {"exact fall", {}}, .result = second_order(0.0), .wall_s = 0.0};
  exact.level.model.tolerance = 1e-6;
  exact.result.vt_out_m_s *= 1.0 + 1e-6;
  EXPECT_EQ(fall_sentence(step, exact),
            "A fall solved for 1e-06 instead of 1e-05 changes outputs by at most 0.0001 % "
            "(vt_out_m_s).\n");
  EXPECT_EQ(json_of_fall(step, exact)["same_mode"], true);
  exact.result.major_mode = "sC sR";
  EXPECT_NE(fall_sentence(step, exact).find("gives another"), std::string::npos);
  EXPECT_EQ(json_of_fall(step, exact)["same_mode"], false);
}

TEST(Convergence, OfTheExplicitStepIsOfOrderFourOnARealImpact) {
  solver::ModelParameters model = solver::preset("paper");
  model.elements_per_link = 2;
  std::ostringstream shown;
  Console console(shown, shown);
  StatusLine line(console);
  const auto refinement = refinement_of(
      "step",
      solve_levels(step_levels(model, 1.0, 2), {1.0, 0.4, 1.0}, line, [](const SolvedLevel&) {}));
  EXPECT_TRUE(converges(refinement));
  // The exit speed is the last output to converge. Its error is far larger than rounding errors.
  const auto& vn_out = named(refinement.convergence, "vn_out_m_s");
  EXPECT_GT(vn_out.extrapolation.order.value(), 3.8);
  EXPECT_LT(vn_out.extrapolation.error.value(), 1e-5);
}

Refinement refinement_with(const std::vector<CaseResult>& results) {
  Refinement refinement{.what = "step", .levels = {}, .convergence = {}};
  for (std::size_t i = 0; i < results.size(); ++i) {
    refinement.levels.push_back(
        {.level = {"dt/" + std::to_string(1 << i), {}}, .result = results[i], .wall_s = 0.0});
  }
  refinement.convergence = convergence_of(results, kHighestOrder);
  return refinement;
}

std::string shown(const Refinement& refinement) {
  std::ostringstream out;
  print_refinement(out, refinement);
  return out.str();
}

TEST(Verdict, GivesTheLargestErrorsOfThePointThatConverges) {
  const auto text =
      shown(refinement_with({second_order(0.1), second_order(0.05), second_order(0.025)}));
  // The relative error is h^2: 0.0625 % at h = 0.025, 1 % at h = 0.1.
  EXPECT_NE(text.find("The step converges; largest estimated error on dt/4: 0.062 %"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("on dt/1: 1 %"), std::string::npos) << text;
}

TEST(Verdict, NamesTheEventThatOnlySomeLevelsHave) {
  auto finest = second_order(0.025);
  finest.major_mode = "SC SR sR sC sR sC sR";
  using solver::PhaseKind;
  finest.phases = {{PhaseKind::kCompression, 0.0, 1e-5, 0.0},
                   {PhaseKind::kRestitution, 1e-5, 2e-4, 0.0},
                   {PhaseKind::kCompression, 2e-4, 2.01e-4, 0.0},
                   {PhaseKind::kRestitution, 2.01e-4, 5e-4, 0.0}};
  auto middle = second_order(0.05);
  middle.phases = {{PhaseKind::kCompression, 0.0, 1e-5, 0.0},
                   {PhaseKind::kRestitution, 1e-5, 5e-4, 0.0}};
  auto coarsest = second_order(0.1);
  coarsest.phases = middle.phases;
  const auto refinement = refinement_with({coarsest, middle, finest});
  EXPECT_FALSE(converges(refinement));
  EXPECT_NE(
      shown(refinement)
          .find(
              "The step does not converge by dt/4: the mode differs on the finest three "
              "levels; a possible cause: dt/4 has a compression of 1 us, from 200.00 to 201.00 us "
              "(V_n grazes 0); dt/2 does not."),
      std::string::npos)
      << shown(refinement);
  const auto json = json_of(refinement);
  EXPECT_EQ(json["converges"], false);
  ASSERT_EQ(json["changes"].size(), 1U);
  EXPECT_EQ(json["changes"][0]["kind"], "compression");
  EXPECT_EQ(json["changes"][0]["finer"], "dt/4");
}

TEST(Verdict, NamesOutputsThatStillChangeByMoreThanAThousandthOfTheirScale) {
  auto finest = second_order(0.025);
  finest.vt_out_m_s = -3.0;
  const auto refinement = refinement_with({second_order(0.1), second_order(0.05), finest});
  EXPECT_FALSE(converges(refinement));
  EXPECT_NE(shown(refinement)
                .find("the mode settles, but these outputs do not: vt_out_m_s; no event differs "
                      "between the finest 2 levels: refine further with --halvings.\n"),
            std::string::npos)
      << shown(refinement);
  auto coarsest = second_order(0.1);
  auto middle = second_order(0.05);
  coarsest.vt_out_m_s = -1.001;
  middle.vt_out_m_s = -1.0;
  finest.vt_out_m_s = -1.005;  // 0.005 m/s is 0.07 % of the speed at touch
  EXPECT_TRUE(converges(refinement_with({coarsest, middle, finest})));
}

}  // namespace
}  // namespace oblique::client
