#include "client/convergence/contact_changes.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace oblique::client {
namespace {

using Kind = ContactChange::Kind;
using solver::CaseResult;
using solver::PhaseKind;

// A contact with these turns (peak, valley, peak, ...) that ends at 100 us.
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

TEST(LonePairs, AreThoseWhoseLeavingOutBringsTheOthersClosest) {
  using Pairs = std::vector<std::size_t>;
  EXPECT_EQ(lone_pairs({}, {}), Pairs{});
  EXPECT_EQ(lone_pairs({1.0, 2.0, 3.0}, {1.1, 2.1, 3.1}), Pairs{});
  EXPECT_EQ(lone_pairs({1.0, 5.0, 5.1, 9.0}, {1.0, 9.0}), Pairs{1});
  EXPECT_EQ(lone_pairs({1.0, 1.1, 5.0}, {5.0}), Pairs{0});
  EXPECT_EQ(lone_pairs({1.0, 5.0, 5.1}, {1.0}), Pairs{1});
  EXPECT_EQ(lone_pairs({1.0, 1.1, 3.0, 5.0, 5.1}, {3.0}), (Pairs{0, 3}));
  EXPECT_EQ(lone_pairs({1.0, 2.0, 3.0, 4.0}, {}), (Pairs{0, 2}));
  EXPECT_EQ(lone_pairs({1.0, 4.0, 6.0, 8.0}, {4.0, 6.0}), Pairs{0}) << "never two single ones";
}

TEST(ContactChanges, AreNoneWhereOnlyTimesDiffer) {
  EXPECT_TRUE(changes_between(with_turns({20, 50, 80}), with_turns({22, 57, 79})).empty());
  EXPECT_TRUE(
      changes_between(with_sticks({{1e-5, 2e-5}}), with_sticks({{1.2e-5, 2.2e-5}})).empty());
}

TEST(ContactChanges, FindACompressionThatComesWithTheFinerLevel) {
  const auto changes = changes_between(with_turns({20}), with_turns({20, 60, 62}));
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_EQ(changes[0].kind, Kind::kCompression);
  EXPECT_DOUBLE_EQ(changes[0].t0_s, 60e-6);
  EXPECT_DOUBLE_EQ(changes[0].t1_s, 62e-6);
  EXPECT_TRUE(changes[0].in_finer);
  EXPECT_EQ(described(changes[0]), "a compression of 2 us, from 60.00 to 62.00 us (V_n grazes 0)");
}

TEST(ContactChanges, FindARestitutionThatGoesWithTheFinerLevel) {
  const auto changes = changes_between(with_turns({20, 21, 30, 50, 80}), with_turns({31, 51, 80}));
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_EQ(changes[0].kind, Kind::kRestitution);
  EXPECT_DOUBLE_EQ(changes[0].t0_s, 20e-6);
  EXPECT_FALSE(changes[0].in_finer);
}

TEST(ContactChanges, FindSticksAndSlipsWhereverTheyAre) {
  const auto last_stick =
      changes_between(with_sticks({{0.0, 3e-5}}), with_sticks({{0.0, 3.1e-5}, {9e-5, 1e-4}}));
  ASSERT_EQ(last_stick.size(), 1U);
  EXPECT_EQ(last_stick[0].kind, Kind::kStick);
  EXPECT_DOUBLE_EQ(last_stick[0].t0_s, 9e-5);

  const auto slip =
      changes_between(with_sticks({{0.0, 5e-5}}), with_sticks({{0.0, 2e-5}, {2.1e-5, 5e-5}}));
  ASSERT_EQ(slip.size(), 1U);
  EXPECT_EQ(slip[0].kind, Kind::kSlip);
  EXPECT_DOUBLE_EQ(slip[0].t0_s, 2e-5);
  EXPECT_DOUBLE_EQ(slip[0].t1_s, 2.1e-5);
}

TEST(ContactChanges, FindAPeakThatIsARippleOnOneLevelOnly) {
  auto ripple = with_turns({20, 50, 60});
  ripple.peaks[1].major = false;
  const auto changes = changes_between(with_turns({20, 50, 60}), ripple);
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_EQ(changes[0].kind, Kind::kRipple);
  EXPECT_DOUBLE_EQ(changes[0].t0_s, 60e-6);
  EXPECT_FALSE(changes[0].in_finer);
}

}  // namespace
}  // namespace oblique::client
