#include "client/autoscale/scaling.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace oblique::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// A cluster in which every job runs at once with a worker of ten threads, each settling two points
/// a second, looked at every ten seconds.
class ScalingTest : public ::testing::Test {
 protected:
  void use(std::size_t least, std::size_t most) {
    ScalingSettings settings;
    settings.least = least;
    settings.most = most;
    settings.target_s = 100.0;
    settings.cool_down_s = 60.0;
    settings.forget_after_s = 120.0;
    scaling_.emplace(settings);
  }

  Decision look(double pause_s = 10.0) {
    now_s_ += pause_s;
    work(pause_s);
    const auto decision = scaling_->decide({demand(), jobs_}, now_s_);
    carry_out(decision);
    return decision;
  }

  /// A decision while the server or the engine is away.
  Decision look_without(bool server, bool engine) {
    now_s_ += 10.0;
    Observation seen;
    if (!server) {
      seen.demand = demand();
    }
    if (!engine) {
      seen.jobs = jobs_;
    }
    const auto decision = scaling_->decide(seen, now_s_);
    carry_out(decision);
    return decision;
  }

  void look_for(double time_s) {
    for (double end_s = now_s_ + time_s; now_s_ < end_s;) {
      look();
    }
  }

  std::size_t running() const { return jobs_.size(); }

  std::optional<Scaling> scaling_;
  std::vector<ListedJob> jobs_;
  std::uint64_t open_points_ = 0;
  bool starts_jobs_ = true;
  bool jobs_come_to_something_ = true;
  double now_s_ = 1000.0;

 private:
  static constexpr std::uint64_t kThreads = 10;
  static constexpr double kPointsPerSecond = 2.0;

  void work(double time_s) {
    for (const auto& job : jobs_) {
      if (job.state == JobState::kRunning && jobs_come_to_something_) {
        const auto done = std::min<std::uint64_t>(
            open_points_, static_cast<std::uint64_t>(time_s * kPointsPerSecond * kThreads));
        open_points_ -= done;
        settled_points_ += done;
      }
    }
  }

  Demand demand() const {
    Demand seen;
    seen.open_points = open_points_;
    seen.settled_points = settled_points_;
    for (const auto& job : jobs_) {
      if (job.state == JobState::kRunning && jobs_come_to_something_) {
        seen.threads += kThreads;
        seen.jobs[job.id] = {
            .workers = 1, .threads = kThreads, .leased_points = open_points_ > 0 ? 5U : 0U};
      }
    }
    return seen;
  }

  void carry_out(const Decision& decision) {
    for (const auto& ids : {decision.withdraw, decision.retire, decision.end}) {
      std::erase_if(jobs_, [&](const ListedJob& job) {
        return std::find(ids.begin(), ids.end(), job.id) != ids.end();
      });
    }
    std::erase_if(jobs_, [](const ListedJob& job) { return job.state == JobState::kEnded; });
    for (std::size_t i = 0; i < decision.submit; ++i) {
      const auto state = !starts_jobs_             ? JobState::kPending
                         : jobs_come_to_something_ ? JobState::kRunning
                                                   : JobState::kEnded;
      jobs_.push_back({std::to_string(++last_id_), state});
      scaling_->note_submitted(jobs_.back().id, now_s_);
    }
  }

  std::uint64_t settled_points_ = 0;
  int last_id_ = 10;
};

TEST_F(ScalingTest, DoesNothingWithoutWork) {
  use(0, 10);
  EXPECT_TRUE(look().changes_nothing());
}

TEST_F(ScalingTest, KeepsTheMinimumWithoutWork) {
  use(2, 10);
  EXPECT_EQ(look().submit, 2U);
  look_for(1000.0);
  EXPECT_EQ(running(), 2U);
}

TEST_F(ScalingTest, BeginsWithOneJobAndSubmitsWhatIsNeededOnceItsRateIsKnown) {
  use(0, 100);
  open_points_ = 20'000;  // ten jobs' work for 100 s
  EXPECT_EQ(look().submit, 1U);
  EXPECT_EQ(look().submit, 0U);
  look_for(60.0);
  EXPECT_EQ(running(), 10U);
}

TEST_F(ScalingTest, NeverHasMoreThanTheMaximum) {
  use(0, 3);
  open_points_ = 100'000'000;
  for (int i = 0; i < 100; ++i) {
    look();
    EXPECT_LE(running(), 3U);
  }
  EXPECT_EQ(running(), 3U);
}

TEST_F(ScalingTest, SubmitsNothingForJobsThatWaitInTheQueue) {
  use(0, 10);
  starts_jobs_ = false;
  open_points_ = 1'000'000;
  look_for(10'000.0);
  EXPECT_EQ(running(), 1U);
}

TEST_F(ScalingTest, RetiresToTheMinimumWhenTheQueueHasBeenEmptyForTheCoolDown) {
  use(1, 10);
  open_points_ = 20'000;
  while (open_points_ > 0) {
    look();
  }
  look_for(50.0);
  ASSERT_GT(running(), 1U);
  look_for(30.0);
  EXPECT_EQ(running(), 1U);
}

TEST_F(ScalingTest, JobsStayBetweenTwoStudiesThatFollowEachOther) {
  use(0, 10);
  for (int study = 0; study < 5; ++study) {
    open_points_ = 20'000;
    while (open_points_ > 0) {
      look();
    }
    look_for(40.0);
  }
  EXPECT_EQ(running(), 10U);
}

TEST_F(ScalingTest, LeavesJobsAtWorkAloneWhenFewerWouldDo) {
  use(0, 10);
  open_points_ = 20'000;
  look_for(70.0);
  ASSERT_EQ(running(), 10U);
  open_points_ = 4000;  // two jobs' work
  for (int i = 0; i < 5; ++i) {
    EXPECT_TRUE(look().changes_nothing());
    open_points_ = 4000;
  }
}

TEST_F(ScalingTest, RetiresJobsAtWorkThatExceedTheMaximum) {
  use(0, 2);
  open_points_ = 1'000'000;
  jobs_ = {{"7", JobState::kRunning}, {"8", JobState::kRunning}, {"9", JobState::kRunning}};
  look();
  EXPECT_EQ(running(), 3U);
  EXPECT_THAT(look(60.0).retire, ElementsAre("9"));
}

TEST_F(ScalingTest, WithdrawsWhatWaitsBeforeItRetiresWhatIdles) {
  use(1, 10);
  jobs_ = {{"7", JobState::kRunning}, {"8", JobState::kRunning}, {"9", JobState::kPending}};
  look();
  const auto decision = look(60.0);
  EXPECT_THAT(decision.withdraw, ElementsAre("9"));
  EXPECT_THAT(decision.retire, ElementsAre("8"));
  EXPECT_THAT(decision.sentences, ElementsAre(HasSubstr("1 job wanted, 3 there")));
}

TEST_F(ScalingTest, ChangesNothingWhileTheServerOrTheEngineIsAway) {
  use(1, 10);
  open_points_ = 1'000'000;
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(look_without(true, false).changes_nothing());
    EXPECT_TRUE(look_without(false, true).changes_nothing());
    EXPECT_TRUE(look_without(true, true).changes_nothing());
  }
}

TEST_F(ScalingTest, AServerThatIsBackIsGivenTheCoolDownToFindItsWorkers) {
  use(0, 10);
  open_points_ = 10'000'000;
  look();
  ASSERT_EQ(running(), 1U);
  look_for(50.0);
  look_without(true, false);
  EXPECT_TRUE(look().changes_nothing());
  EXPECT_TRUE(look().changes_nothing());
  look_for(60.0);
  EXPECT_EQ(running(), 10U);
}

TEST_F(ScalingTest, AnotherAutoscalerThatBeginsFindsTheJobsAndAddsNone) {
  use(0, 10);
  open_points_ = 1'000'000;
  look_for(200.0);
  ASSERT_EQ(running(), 10U);
  use(0, 10);
  look_for(200.0);
  EXPECT_EQ(running(), 10U);
}

TEST_F(ScalingTest, AVanishedJobIsReplacedAfterItsTimeAndNotBefore) {
  use(0, 1);
  open_points_ = 10'000'000;
  look_for(100.0);
  ASSERT_EQ(running(), 1U);
  jobs_.clear();
  look_for(110.0);
  EXPECT_EQ(running(), 0U);
  look_for(30.0);
  EXPECT_EQ(running(), 1U);
}

TEST_F(ScalingTest, JobsThatEndAtOnceAreSubmittedEverMoreSeldom) {
  use(0, 10);
  jobs_come_to_something_ = false;
  open_points_ = 1'000'000;
  std::size_t submitted = 0;
  for (int i = 0; i < 24 * 360; ++i) {  // a day
    submitted += look().submit;
  }
  EXPECT_GT(submitted, 5U);
  EXPECT_LT(submitted, 40U);
}

TEST_F(ScalingTest, AnEngineThatRefusesIsAskedEverMoreSeldom) {
  use(0, 10);
  open_points_ = 1'000'000;
  std::size_t asked = 0;
  for (int i = 0; i < 24 * 360; ++i) {  // a day
    now_s_ += 10.0;
    Demand demand;
    demand.open_points = open_points_;
    const auto decision = scaling_->decide({demand, std::vector<ListedJob>()}, now_s_);
    if (decision.submit > 0) {
      ++asked;
      scaling_->note_submission_failed(now_s_);
    }
  }
  EXPECT_GT(asked, 5U);
  EXPECT_LT(asked, 40U);
}

TEST_F(ScalingTest, AJobThatDoesNotLeaveWhenAskedIsEnded) {
  use(0, 10);
  const std::vector<ListedJob> stays{{"7", JobState::kRunning}};
  const auto decide = [&](double at_s) { return scaling_->decide({Demand(), stays}, at_s); };
  decide(0.0);
  EXPECT_THAT(decide(60.0).retire, ElementsAre("7"));
  EXPECT_THAT(decide(119.0).end, IsEmpty());
  EXPECT_THAT(decide(120.0).end, ElementsAre("7"));
  EXPECT_THAT(decide(121.0).end, IsEmpty());
}

TEST_F(ScalingTest, WhatNoWorkerWouldHelpIsToldOnce) {
  use(0, 10);
  Demand demand;
  demand.blocked = {"wide waits for the database"};
  EXPECT_THAT(scaling_->decide({demand, std::vector<ListedJob>()}, 0.0).sentences,
              ElementsAre(HasSubstr("wide waits for the database")));
  EXPECT_THAT(scaling_->decide({demand, std::vector<ListedJob>()}, 10.0).sentences, IsEmpty());
}

}  // namespace
}  // namespace oblique::client
