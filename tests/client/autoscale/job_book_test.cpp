#include "client/autoscale/job_book.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace oblique::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Demand heard(const std::vector<std::string>& jobs) {
  Demand demand;
  for (const auto& job : jobs) {
    demand.jobs[job] = {.workers = 1, .threads = 8, .leased_points = 5};
    demand.threads += 8;
  }
  return demand;
}

class JobBookTest : public ::testing::Test {
 protected:
  static constexpr double kForget_s = 60.0;
  JobBook book_{kForget_s};
};

TEST_F(JobBookTest, FindsJobsThatAnotherProcessSubmitted) {
  book_.update({{"12", JobState::kPending}, {"13", JobState::kRunning}}, {}, 0.0);
  EXPECT_EQ(book_.count(), 2U);
}

TEST_F(JobBookTest, CountsASubmittedJobBeforeItIsListed) {
  book_.note_submitted("12", 0.0);
  book_.update({}, {}, 1.0);
  EXPECT_EQ(book_.count(), 1U);
}

TEST_F(JobBookTest, ForgetsAJobThatIsNeitherListedNorHeardOfAndSaysSo) {
  book_.update({{"12", JobState::kRunning}}, heard({"12"}), 0.0);
  EXPECT_THAT(book_.update({}, {}, 1.0), IsEmpty());
  EXPECT_THAT(book_.update({}, {}, 60.9), IsEmpty());
  EXPECT_EQ(book_.count(), 1U);
  EXPECT_THAT(book_.update({}, {}, 61.0), ElementsAre(HasSubstr("job 12 vanished")));
  EXPECT_EQ(book_.count(), 0U);
}

TEST_F(JobBookTest, KeepsAJobThatIsNotListedAsLongAsItsWorkersAreHeard) {
  book_.update({{"12", JobState::kRunning}}, heard({"12"}), 0.0);
  EXPECT_THAT(book_.update({}, heard({"12"}), 1000.0), IsEmpty());
  EXPECT_EQ(book_.count(), 1U);
}

TEST_F(JobBookTest, AJobThatEndedIsGoneAtOnce) {
  book_.update({{"12", JobState::kRunning}}, heard({"12"}), 0.0);
  book_.update({{"12", JobState::kEnded}}, {}, 1.0);
  EXPECT_EQ(book_.count(), 0U);
}

TEST_F(JobBookTest, JobsThatEndedBeforeAWorkerWasHeardAreCountedUntilOneIs) {
  for (const char* id : {"1", "2", "3"}) {
    book_.note_submitted(id, 0.0);
    book_.update({{id, JobState::kEnded}}, {}, 1.0);
    book_.update({{id, JobState::kEnded}}, {}, 2.0);  // it is listed for a while
  }
  EXPECT_EQ(book_.fruitless(), 3);
  book_.update({{"4", JobState::kRunning}}, heard({"4"}), 3.0);
  EXPECT_EQ(book_.fruitless(), 0);
}

TEST_F(JobBookTest, SaysOnceThatARunningJobHasNoWorker) {
  book_.update({{"12", JobState::kRunning}}, {}, 0.0);
  EXPECT_THAT(book_.update({{"12", JobState::kRunning}}, {}, 60.0),
              ElementsAre(HasSubstr("heard of no worker")));
  EXPECT_THAT(book_.update({{"12", JobState::kRunning}}, {}, 120.0), IsEmpty());
  EXPECT_EQ(book_.count(), 1U);
}

TEST_F(JobBookTest, AJobThatWaitsInTheQueueIsNotMissed) {
  book_.update({{"12", JobState::kPending}}, {}, 0.0);
  EXPECT_THAT(book_.update({{"12", JobState::kPending}}, {}, 1e6), IsEmpty());
  EXPECT_EQ(book_.count(), 1U);
}

TEST_F(JobBookTest, AJobThatIsQueuedAgainStaysEvenWhenItWasAskedToLeave) {
  book_.update({{"12", JobState::kRunning}}, heard({"12"}), 0.0);
  book_.note_retired("12", 1.0);
  EXPECT_EQ(book_.count(), 0U);
  book_.update({{"12", JobState::kPending}}, {}, 2.0);
  EXPECT_EQ(book_.count(), 1U);
}

TEST_F(JobBookTest, NamesTheNewestJobFirst) {
  book_.update({{"9", JobState::kRunning}, {"100", JobState::kRunning}, {"99", JobState::kRunning}},
               {}, 0.0);
  EXPECT_THAT(book_.ids(JobBook::stays), ElementsAre("100", "99", "9"));
}

TEST_F(JobBookTest, RemembersHowManyThreadsAJobHas) {
  EXPECT_FALSE(book_.threads_a_job());
  book_.update({{"1", JobState::kRunning}, {"2", JobState::kRunning}}, heard({"1"}), 0.0);
  EXPECT_DOUBLE_EQ(*book_.threads_a_job(), 8.0);
  book_.update({{"1", JobState::kEnded}}, {}, 1.0);
  EXPECT_DOUBLE_EQ(*book_.threads_a_job(), 8.0);
}

TEST_F(JobBookTest, AJobWhoseWorkersAreStillComingSaysNothingOfTheThreadsOfAJob) {
  Demand demand;
  demand.jobs["1"] = {.workers = 4, .threads = 32, .leased_points = 0};
  book_.update({{"1", JobState::kRunning}}, demand, 0.0);
  demand.jobs["2"] = {.workers = 1, .threads = 8, .leased_points = 0};
  book_.update({{"1", JobState::kRunning}, {"2", JobState::kRunning}}, demand, 1.0);
  EXPECT_DOUBLE_EQ(*book_.threads_a_job(), 32.0);
  book_.update({{"1", JobState::kRunning}, {"2", JobState::kRunning}}, demand, 2.0);
  EXPECT_DOUBLE_EQ(*book_.threads_a_job(), 20.0);
}

}  // namespace
}  // namespace oblique::client
