#include "server/service/study_states.h"

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
  return {name, table_of(10), "2026-01-01T00:00:00.000Z", {}, {}, 0};
}

StoredStudy stored(StudyState state, std::uint64_t completed) {
  StoredStudy study{};
  study.study_id = 1;
  study.name = "a";
  study.table = table_of(10);
  study.state = state;
  study.completed = IntervalSet(0, completed);
  return study;
}

class StudyStatesTest : public testing::Test {
 protected:
  StudyStatesTest() {
    states_.add(1, record_of("a"));
    states_.set_durable(1, 5);
  }
  StudyStates states_;
};

TEST_F(StudyStatesTest, AStudyIsFoundByNameAtOnceButOnlyShownWhenItIsDurable) {
  states_.add(2, record_of("b"));
  EXPECT_EQ(states_.find("b"), 2U);
  EXPECT_EQ(states_.find_durable("b"), std::nullopt);
  EXPECT_EQ(states_.find_durable("", 2), std::nullopt);
  EXPECT_EQ(states_.durable_after(1), std::nullopt);
  states_.set_durable(2, 7);
  EXPECT_EQ(states_.find_durable("b"), 2U);
  EXPECT_EQ(states_.find_durable("a", 2), 2U) << "the number decides";
  EXPECT_EQ(states_.durable_after(0), 1U);
  EXPECT_EQ(states_.durable_after(1), 2U);
  EXPECT_EQ(states_.record(2).since_ms, 7);
}

TEST_F(StudyStatesTest, ARemovedStudyLeavesItsNameFree) {
  states_.add(2, record_of("b"));
  states_.remove(2);
  EXPECT_FALSE(states_.contains(2));
  EXPECT_EQ(states_.find("b"), std::nullopt);
  EXPECT_THROW(states_.record(2), std::out_of_range);
  states_.add(3, record_of("b"));
  EXPECT_EQ(states_.find("b"), 3U);
}

TEST_F(StudyStatesTest, OnlyAnotherOrADoubtfulStateNeedsAWrite) {
  EXPECT_FALSE(states_.needs_write(1, kRunning));
  EXPECT_TRUE(states_.needs_write(1, kPaused));
  states_.set_doubtful(1);
  EXPECT_TRUE(states_.needs_write(1, kRunning)) << "the disk may have taken the refused one";
  states_.set_state(1, kRunning);
  EXPECT_FALSE(states_.needs_write(1, kRunning));
}

TEST_F(StudyStatesTest, ADoneStudyKeepsItsStateUntilFailuresAreForgotten) {
  EXPECT_TRUE(states_.finish(1));
  EXPECT_FALSE(states_.finish(1));
  states_.set_state(1, kPaused);
  EXPECT_EQ(states_.state(1), kDone);
  for (const auto state : {kRunning, kPaused, kCancelled, kDone}) {
    EXPECT_FALSE(states_.needs_write(1, state));
  }
  states_.forget_failures(1, IntervalSet(3, 4), 99);
  EXPECT_EQ(states_.state(1), kRunning);
  states_.set_state(1, kPaused);
  states_.forget_failures(1, IntervalSet(3, 4), 99);
  EXPECT_EQ(states_.state(1), kPaused);
}

TEST_F(StudyStatesTest, OpenStudiesAreCountedWithTheirPoints) {
  states_.add(2, record_of("b"));
  EXPECT_EQ(states_.open_points(), 20U);
  states_.set_state(1, kPaused);
  EXPECT_EQ(states_.unfinished(), (std::set<StudyId>{1, 2}));
  states_.grow(2, table_of(15), 3);
  EXPECT_EQ(states_.open_points(), 25U);
  states_.set_state(1, kCancelled);
  EXPECT_EQ(states_.open_points(), 15U);
  states_.remove(2);
  EXPECT_EQ(states_.open_points(), 0U);
  EXPECT_EQ(states_.counts(), (std::array<std::uint64_t, kStudyStates>{0, 0, 1, 0}));
}

TEST_F(StudyStatesTest, FailuresAreKnownUntilTheyAreForgotten) {
  states_.point_failed(1, 3);
  states_.point_failed(1, 5);
  EXPECT_EQ(states_.record(1).failures.size(), 2U);
  states_.forget_failures(1, IntervalSet(3, 4), 99);
  EXPECT_EQ(states_.record(1).failures, IntervalSet(5, 6));
  EXPECT_EQ(states_.record(1).since_ms, 99);
}

TEST(RestoredStudy, HasTheStateOfTheDatabaseUnlessRowsOfADoneStudyAreLost) {
  for (const auto state : {kRunning, kPaused, kCancelled, kDone}) {
    for (const std::uint64_t completed : {9U, 10U}) {
      StudyStates states;
      states.restore(stored(state, completed), 0);
      EXPECT_EQ(states.state(1), state == kDone && completed < 10 ? kRunning : state);
      EXPECT_EQ(states.find_durable("a"), 1U);
    }
  }
}

}  // namespace
}  // namespace oblique::server
