#include "server/service/counts/study_states.h"

#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/support/points.h"

namespace oblique::server {
namespace {

constexpr auto kRunning = StudyState::kRunning;
constexpr auto kPaused = StudyState::kPaused;
constexpr auto kCancelled = StudyState::kCancelled;
constexpr auto kDone = StudyState::kDone;

StudyRecord record_of(const std::string& name) {
  return {name, table_of(10), "2026-01-01T00:00:00.000Z", {}, {}, {}, 0};
}

StoredStudy stored(StudyState state, std::uint64_t settled) {
  StoredStudy study{};
  study.study_id = 1;
  study.name = "a";
  study.table = table_of(10);
  study.state = state;
  study.completed = IntervalSet(0, settled);
  return study;
}

class StudyStatesTest : public testing::Test {
 protected:
  StudyStatesTest() {
    states_.add(1, record_of("a"));
    states_.added(1, 5);
  }
  StudyStates states_;
};

TEST_F(StudyStatesTest, AStudyIsFoundByNameAtOnceButOnlyShownWhenItIsDurable) {
  states_.add(2, record_of("b"));
  EXPECT_EQ(states_.find("b"), 2U);
  EXPECT_EQ(states_.find_durable("b"), std::nullopt);
  EXPECT_EQ(states_.durable_after(1), std::nullopt);
  states_.added(2, 7);
  EXPECT_EQ(states_.find_durable("b"), 2U);
  EXPECT_EQ(states_.durable_after(1), 2U);
  EXPECT_EQ(states_.record(2).since_ms, 7);
}

TEST_F(StudyStatesTest, AStudyThatWasRefusedLeavesItsNameFree) {
  states_.add(2, record_of("b"));
  states_.remove(2);
  EXPECT_FALSE(states_.contains(2));
  EXPECT_EQ(states_.find("b"), std::nullopt);
  EXPECT_THROW(states_.record(2), std::out_of_range);
  states_.add(3, record_of("b"));
  EXPECT_EQ(states_.find("b"), 3U);
}

TEST_F(StudyStatesTest, DurableStudiesAreWalkedInTheOrderOfTheirNumbersAndOthersPassedOver) {
  states_.add(2, record_of("on its way"));
  states_.add(7, record_of("c"));
  states_.added(7, 0);
  EXPECT_EQ(states_.durable_after(0), 1U);
  EXPECT_EQ(states_.durable_after(1), 7U);
  EXPECT_EQ(states_.durable_after(7), std::nullopt);
}

TEST_F(StudyStatesTest, TheStateThatItHasNeedsNoWriteAndAnyOtherDoes) {
  EXPECT_FALSE(states_.needs_write(1, kRunning));
  EXPECT_TRUE(states_.needs_write(1, kPaused));
  EXPECT_TRUE(states_.needs_write(1, kCancelled));
}

TEST_F(StudyStatesTest, ALoneStateThatIsStoredHoldsAndNeedsNoOtherWrite) {
  states_.change(1, kPaused);
  EXPECT_EQ(states_.state(1), kPaused);
  EXPECT_TRUE(states_.needs_write(1, kPaused)) << "it may be refused yet";
  states_.changed(1, kPaused);
  EXPECT_EQ(states_.state(1), kPaused);
  EXPECT_FALSE(states_.needs_write(1, kPaused));
}

TEST_F(StudyStatesTest, ALoneStateThatIsRefusedLeavesTheOneBeforeInDoubt) {
  states_.change(1, kPaused);
  states_.refused(1);
  EXPECT_EQ(states_.state(1), kRunning);
  EXPECT_TRUE(states_.needs_write(1, kRunning)) << "the disk may have taken the other one";
  states_.change(1, kRunning);
  states_.changed(1, kRunning);
  EXPECT_FALSE(states_.needs_write(1, kRunning)) << "written over it, so there is no doubt";
}

TEST_F(StudyStatesTest, ALoneRefusedStateFallsBackOnTheLatestDurableOneNotOnTheFirst) {
  states_.change(1, kPaused);
  states_.changed(1, kPaused);
  states_.change(1, kCancelled);
  states_.refused(1);
  EXPECT_EQ(states_.state(1), kPaused);
}

TEST_F(StudyStatesTest, OfSeveralOnTheirWayTheLastOneStandsWhateverBecomesOfTheOthers) {
  for (const bool first_is_stored : {false, true}) {
    states_.change(1, kPaused);
    states_.change(1, kCancelled);
    first_is_stored ? states_.changed(1, kPaused) : states_.refused(1);
    EXPECT_EQ(states_.state(1), kCancelled);
    EXPECT_TRUE(states_.needs_write(1, kCancelled)) << "one is on its way still";
    states_.changed(1, kCancelled);
    EXPECT_EQ(states_.state(1), kCancelled);
    EXPECT_FALSE(states_.needs_write(1, kCancelled));
  }
}

TEST_F(StudyStatesTest, WhenTheLastOfSeveralIsRefusedTheLastStoredOneHolds) {
  states_.change(1, kPaused);
  states_.change(1, kCancelled);
  states_.changed(1, kPaused);
  states_.refused(1);
  EXPECT_EQ(states_.state(1), kPaused);
}

TEST_F(StudyStatesTest, WhenAllOfSeveralAreRefusedTheOneBeforeThemHolds) {
  states_.change(1, kPaused);
  states_.change(1, kCancelled);
  states_.refused(1);
  states_.refused(1);
  EXPECT_EQ(states_.state(1), kRunning);
}

TEST_F(StudyStatesTest, AStudyIsFinishedOnce) {
  EXPECT_TRUE(states_.finish(1));
  EXPECT_FALSE(states_.finish(1));
  EXPECT_EQ(states_.state(1), kDone);
  for (const auto state : {kRunning, kPaused, kCancelled, kDone}) {
    EXPECT_FALSE(states_.needs_write(1, state));
  }
}

TEST_F(StudyStatesTest, AStudyThatFinishesWhileStatesAreOnTheirWayStaysDoneWhateverBecomesOfThem) {
  states_.change(1, kPaused);
  states_.change(1, kCancelled);
  states_.finish(1);
  states_.changed(1, kPaused);
  EXPECT_EQ(states_.state(1), kDone);
  states_.refused(1);
  EXPECT_EQ(states_.state(1), kDone);
}

TEST_F(StudyStatesTest, FailuresAreKnownWithTheirAttemptsAndAttemptsOutliveForgetting) {
  states_.point_failed(1, 3, 2);
  states_.point_failed(1, 5, 1);
  EXPECT_EQ(states_.record(1).failures.size(), 2U);
  states_.finish(1);
  states_.forget_failures(1, IntervalSet(3, 4), 99);
  EXPECT_EQ(states_.record(1).failures, IntervalSet(5, 6));
  EXPECT_EQ(states_.state(1), kRunning);
  EXPECT_EQ(states_.record(1).since_ms, 99);
  std::vector<std::uint32_t> attempts;
  states_.record(1).attempts.for_each(
      [&](const Interval&, std::uint32_t attempt) { attempts.push_back(attempt); });
  EXPECT_EQ(attempts, (std::vector<std::uint32_t>{2, 1}));
}

TEST_F(StudyStatesTest, ForgettingFailuresOfAPausedStudyLeavesItPaused) {
  states_.change(1, kPaused);
  states_.changed(1, kPaused);
  states_.forget_failures(1, IntervalSet(3, 4), 99);
  EXPECT_EQ(states_.state(1), kPaused);
}

TEST_F(StudyStatesTest, AfterARetryOfADoneStudyARefusedStateFallsBackOnRunning) {
  states_.finish(1);
  states_.forget_failures(1, IntervalSet(3, 4), 99);
  states_.change(1, kPaused);
  states_.refused(1);
  EXPECT_EQ(states_.state(1), kRunning);
}

TEST(RestoredStudy, HasTheStateOfTheDatabaseWithoutDoubt) {
  for (const auto state : {kRunning, kPaused, kCancelled}) {
    StudyStates states;
    states.restore(stored(state, 4), 0);
    EXPECT_EQ(states.state(1), state);
    EXPECT_FALSE(states.needs_write(1, state));
    EXPECT_EQ(states.find_durable("a"), 1U);
  }
}

TEST(RestoredStudy, ThatIsCalledDoneRunsAgainWhenRowsOfItAreLost) {
  StudyStates whole;
  whole.restore(stored(kDone, 10), 0);
  EXPECT_EQ(whole.state(1), kDone);
  StudyStates lacking;
  lacking.restore(stored(kDone, 9), 0);
  EXPECT_EQ(lacking.state(1), kRunning);
}

TEST(RestoredStudy, ThatIsPausedIsPausedStillWhenAnotherStateIsRefused) {
  StudyStates states;
  states.restore(stored(kPaused, 4), 0);
  states.change(1, kRunning);
  states.refused(1);
  EXPECT_EQ(states.state(1), kPaused);
}

}  // namespace
}  // namespace oblique::server
