#include "client/autoscale/autoscaler.h"

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace oblique::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Remembers what it was told; may be away.
class FakeEngine : public Engine {
 public:
  std::vector<ListedJob> jobs() override {
    answer();
    return jobs_;
  }
  std::string submit() override {
    answer();
    if (refuses_) {
      throw EngineError("invalid partition");
    }
    jobs_.push_back({std::to_string(jobs_.size() + 1), JobState::kRunning});
    return jobs_.back().id;
  }
  void withdraw(const Ids& ids) override { remove(ids, "withdraw"); }
  void retire(const Ids& ids) override {
    if (heeds_) {
      remove(ids, "retire");
    }
  }
  void end(const Ids& ids) override { remove(ids, "end"); }
  std::optional<std::string> job_of_worker(const std::string& /*name*/) const override {
    return std::nullopt;
  }
  std::string submission() const override { return "sbatch workers"; }

  std::vector<ListedJob> jobs_;
  std::vector<std::string> orders_;
  bool away_ = false;
  bool refuses_ = false;
  bool heeds_ = true;

 private:
  void answer() const {
    if (away_) {
      throw EngineError("squeue took longer than 30 s");
    }
  }
  void remove(const Ids& ids, const std::string& order) {
    answer();
    for (const auto& id : ids) {
      orders_.push_back(order + " " + id);
      std::erase_if(jobs_, [&](const ListedJob& job) { return job.id == id; });
    }
  }
};

class AutoscalerTest : public ::testing::Test {
 protected:
  static ScalingSettings settings() {
    ScalingSettings settings;
    settings.most = 3;
    settings.cool_down_s = 10.0;
    return settings;
  }

  Demand ask() const {
    if (server_away_) {
      throw ConnectionError("no answer from tcp://head:7600 within 10 s");
    }
    Demand demand;
    demand.open_points = 1000;
    return demand;
  }

  bool look(double at_s, bool only_tells = false) {
    told_.clear();
    return autoscaler_.look(at_s, only_tells);
  }

  FakeEngine engine_;
  bool server_away_ = false;
  std::vector<std::string> told_;
  Autoscaler autoscaler_{settings(), engine_, [this] { return ask(); },
                         [this](const std::string& sentence) { told_.push_back(sentence); }};
};

TEST_F(AutoscalerTest, SubmitsAndSaysWhy) {
  EXPECT_TRUE(look(0.0));
  EXPECT_EQ(engine_.jobs_.size(), 1U);
  EXPECT_THAT(told_, ElementsAre(HasSubstr("1,000 points are open"), "submitted: job 1"));
}

TEST_F(AutoscalerTest, ADryRunOnlySaysWhatItWouldDo) {
  EXPECT_TRUE(look(0.0, true));
  EXPECT_TRUE(engine_.jobs_.empty());
  EXPECT_THAT(told_, ElementsAre(HasSubstr("1,000 points are open"),
                                 "would submit a job with: sbatch workers"));
}

TEST_F(AutoscalerTest, AServerThatIsAwayIsNamedOnceAndOnceMoreWhenItIsBack) {
  server_away_ = true;
  EXPECT_FALSE(look(0.0));
  EXPECT_THAT(told_, ElementsAre(HasSubstr("no answer from tcp://head:7600")));
  EXPECT_FALSE(look(100.0));
  EXPECT_THAT(told_, IsEmpty());
  server_away_ = false;
  EXPECT_TRUE(look(200.0));
  EXPECT_THAT(told_, ElementsAre("the server is there again"));
  EXPECT_TRUE(engine_.jobs_.empty());
}

TEST_F(AutoscalerTest, AnEngineThatIsAwayIsNamedOnceAndAskedAgain) {
  engine_.away_ = true;
  EXPECT_FALSE(look(0.0));
  EXPECT_THAT(told_, ElementsAre(HasSubstr("squeue took longer")));
  EXPECT_FALSE(look(100.0));
  EXPECT_THAT(told_, IsEmpty());
  engine_.away_ = false;
  EXPECT_TRUE(look(200.0));
  EXPECT_THAT(told_, ElementsAre("the list of jobs is there again",
                                 HasSubstr("1,000 points are open"), "submitted: job 1"));
}

TEST_F(AutoscalerTest, ARefusedSubmissionIsToldOnceAndTriedAgainLater) {
  engine_.refuses_ = true;
  EXPECT_FALSE(look(0.0));
  EXPECT_THAT(told_, ElementsAre(HasSubstr("points are open"), HasSubstr("invalid partition")));
  EXPECT_TRUE(look(10.0));
  EXPECT_THAT(told_, IsEmpty());
  engine_.refuses_ = false;
  EXPECT_TRUE(look(1000.0));
  EXPECT_EQ(engine_.jobs_.size(), 1U);
}

/// Waiting that takes no time, up to `seconds` of it.
std::function<bool(double)> patience(double seconds) {
  return [left = seconds](double waited) mutable { return (left -= waited) >= 0.0; };
}

TEST_F(AutoscalerTest, RetiringWithdrawsWhatWaitsAndAsksWhatRuns) {
  engine_.jobs_ = {{"1", JobState::kPending}, {"2", JobState::kRunning}, {"3", JobState::kEnded}};
  EXPECT_FALSE(retire_all(engine_, 60.0, patience(0.0), [](const auto&) {}));
  EXPECT_THAT(engine_.orders_, ElementsAre("withdraw 1", "retire 2"));
}

TEST_F(AutoscalerTest, RetiringEndsAtLastWhatDoesNotHeed) {
  engine_.heeds_ = false;
  engine_.jobs_ = {{"2", JobState::kRunning}};
  EXPECT_FALSE(retire_all(engine_, 60.0, patience(59.0), [](const auto&) {}));
  EXPECT_THAT(engine_.orders_, IsEmpty());
  EXPECT_TRUE(retire_all(engine_, 60.0, patience(100.0), [](const auto&) {}));
  EXPECT_THAT(engine_.orders_, ElementsAre("end 2"));
}

}  // namespace
}  // namespace oblique::client
