// Tests of reused results and of left-out points.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/service/service_fixture.h"
#include "tests/support/recipes.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class ServiceReuseTest : public ServiceTest {
 protected:
  static constexpr std::uint64_t kSource = 1;
  static constexpr std::uint64_t kStudy = 2;

  /// Submits study 1, "a", and solves some of its points.
  void solve_some() {
    request(submit_request("a"));
    write_all();
    hello();
    credit(1);
    answer_batch(1000);
  }
  ClientRequest reusing(const std::string& name, std::uint64_t points = 10) {
    ClientRequest message = submit_request(name, points);
    message.mutable_submit()->set_no_reuse(false);
    return message;
  }
  /// Returns the same submission as `reusing`, with ten more points.
  ClientRequest grown_request(const std::string& name, std::uint64_t points = 10) {
    ClientRequest message = reusing(name, points);
    *message.mutable_submit()->mutable_recipe()->add_blocks() = table_of(10)->recipe().blocks(0);
    return message;
  }
  /// Submits and stores study 2, "b". Its first reuse of results then waits for the writer.
  void submit_study() {
    solve_some();
    request(reusing("b"));
    write_all();
  }
  /// Returns the first point of each ReuseResults that waits for the writer.
  std::vector<std::uint64_t> parts() const {
    std::vector<std::uint64_t> firsts;
    for (const WriteJob& job : ports_.jobs) {
      if (const auto* part = std::get_if<ReuseResults>(&job.change)) {
        firsts.push_back(part->first_point);
      }
    }
    return firsts;
  }
  /// Returns the study whose EndReuse waits for the writer, or 0.
  std::uint64_t ended() const {
    for (const WriteJob& job : ports_.jobs) {
      if (const auto* end = std::get_if<EndReuse>(&job.change)) {
        return end->study_id;
      }
    }
    return 0;
  }
  /// Completes all waiting writes. Each ReuseResults among them gets this outcome.
  void write_part(const ReusedResults& outcome) {
    for (WriteJob& job : ports_.jobs) {
      if (const auto* part = std::get_if<ReuseResults>(&job.change)) {
        *part->outcome = outcome;
      }
    }
    write_all();
  }
  static ReusedResults copies_of_a(const IntervalSet& points,
                                   std::optional<std::uint64_t> next = {}) {
    return {points, {{"a", points.size()}}, points.size(), next};
  }
};

TEST_F(ServiceReuseTest, NothingIsLookedUpWithoutAnyResultOrForARequestWithoutReuse) {
  request(reusing("first"));
  write_all();
  EXPECT_THAT(ports_.jobs, IsEmpty());
  EXPECT_TRUE(last_reply().has_submit());
  hello_and_credit();
  answer_batch(1000);
  submit("b");
  EXPECT_THAT(ports_.jobs, IsEmpty());
  EXPECT_EQ(last_reply().submit().study_id(), kStudy);
}

TEST_F(ServiceReuseTest, UntilTheLookupEndsNothingIsLeasedAndTheReplyWaits) {
  solve_some();
  request(reusing("b"));
  const std::size_t replies = ports_.replies.size();
  write_all();
  EXPECT_THAT(parts(), ElementsAre(0));
  EXPECT_EQ(ports_.replies.size(), replies);
  EXPECT_THAT(status_of("b").waits_for(), HasSubstr("the lookup of results of other studies"));
  write_part(copies_of_a(IntervalSet(0, 4), 6));
  EXPECT_THAT(parts(), ElementsAre(6));
  EXPECT_EQ(status_of("b").solved(), 4U);
  EXPECT_THAT(status_of("b").waits_for(), HasSubstr("4 reused so far"));
  write_part({});
  EXPECT_EQ(ended(), kStudy);
  write_all();
  const auto reply = last_reply().submit();
  EXPECT_EQ(reply.completed(), 4U);
  EXPECT_EQ(reply.reused().points(), 4U);
  EXPECT_EQ(reply.reused().from(0).study(), "a");
  EXPECT_FALSE(status_of("b").reused().under_way());
  EXPECT_EQ(status_of("b").waits_for(), "");
  EXPECT_THAT(ports_.jobs, IsEmpty());
}

TEST_F(ServiceReuseTest, TheReplyWaitsAtMostSomeSeconds) {
  submit_study();
  now_.steady_ms += 2000;
  service_->tick(now_);
  const auto reply = last_reply().submit();
  EXPECT_EQ(reply.study_id(), kStudy);
  EXPECT_TRUE(reply.reused().under_way());
}

TEST_F(ServiceReuseTest, ALookupIsCutShortAfterAMillionProbesOrALongTimeWithoutAResult) {
  for (const bool is_long : {false, true}) {
    start({});
    submit_study();
    const auto part_without_result = [&](std::uint64_t next) {
      now_.steady_ms += is_long ? StudyChanges::kLongestInVain_ms / 2 : 0;
      write_part({{}, {}, is_long ? 1 : StudyChanges::kMaxProbesInVain / 2, next});
    };
    part_without_result(1);
    write_part(copies_of_a(IntervalSet(0, 1), 2));  // restarts both limits
    part_without_result(3);
    EXPECT_THAT(parts(), ElementsAre(3));
    part_without_result(4);
    EXPECT_EQ(ended(), kStudy);
    write_all();
    EXPECT_TRUE(last_reply().submit().reused().cut_short());
  }
}

TEST_F(ServiceReuseTest, ALookupThatKeepsFindingResultsEndsAfterHalfAMinute) {
  submit_study();
  std::uint64_t parts_written = 0;
  while (ended() == 0) {
    ASSERT_LT(parts_written, 100U);
    now_.steady_ms += 1000;
    ++parts_written;
    write_part(copies_of_a(IntervalSet(parts_written - 1, parts_written), parts_written));
  }
  EXPECT_EQ(parts_written, StudyChanges::kLongestLookup_ms / 1000);
  write_all();
  EXPECT_TRUE(status_of("b").reused().cut_short());
  EXPECT_EQ(status_of("b").waits_for(), "") << "the other points are leased";
}

TEST_F(ServiceReuseTest, AFailedLookupIsCutShortAndTheStudyRuns) {
  submit_study();
  write_all("a page is damaged");
  EXPECT_EQ(ended(), kStudy);
  write_all();
  EXPECT_TRUE(last_reply().submit().reused().cut_short());
  EXPECT_EQ(status_of("b").waits_for(), "");
}

TEST_F(ServiceReuseTest, AStudyThatGrowsIsLookedUpAgain) {
  solve_some();
  request(reusing("b", 7));
  write_all();
  write_part({});
  write_all();
  request(grown_request("b", 7));
  write_all();
  EXPECT_THAT(parts(), ElementsAre(0));
  write_part({});
  write_all();
  EXPECT_EQ(last_reply().submit().appended(), 10U);
}

TEST_F(ServiceReuseTest, AStudyDoesNotGrowDuringItsLookup) {
  submit_study();
  request(grown_request("b"));
  EXPECT_THAT(last_error(), HasSubstr("cannot grow while results"));
}

TEST_F(ServiceReuseTest, ACancelledOrDeletedStudyIsNotLookedUpFurther) {
  for (const auto change : {protocol::STUDY_CHANGE_CANCEL, protocol::STUDY_CHANGE_DELETE}) {
    start({});
    submit_study();
    const WriteJob part = ports_.jobs.at(0);
    ports_.jobs.clear();
    request(change_request("b", change));
    write_all();
    ports_.jobs.push_back(part);
    write_part(copies_of_a(IntervalSet(0, 4), 4));
    EXPECT_EQ(ended(), change == protocol::STUDY_CHANGE_CANCEL ? kStudy : 0U);
    write_all();
  }
}

TEST_F(ServiceReuseTest, AStoppedLookupIsLeftToTheNextServer) {
  submit_study();
  service_->drain(now_);
  write_part(copies_of_a(IntervalSet(0, 4), 4));
  EXPECT_THAT(ports_.jobs, IsEmpty());
}

TEST_F(ServiceReuseTest, AServerContinuesAnUnfinishedLookup) {
  StoredStudy source{kSource, "a", table_of(10), StudyState::kRunning, "then", {}, {}, {}, {}};
  source.completed = IntervalSet(0, 5);
  StoredStudy pending{kStudy, "b", table_of(10), StudyState::kRunning, "then", {}, {}, {}, {}};
  pending.reuses = true;
  pending.reused = {{"a", 3}};
  pending.completed = IntervalSet(0, 3);
  start({}, {source, pending});
  EXPECT_THAT(parts(), ElementsAre(0));
  EXPECT_EQ(status_of("b").reused().points(), 3U);
  EXPECT_TRUE(status_of("b").reused().under_way());
  write_part(copies_of_a(IntervalSet(3, 5)));
  EXPECT_EQ(ended(), kStudy);
  EXPECT_EQ(status_of("b").reused().points(), 5U);
}

// ---- Filters ----

class FilteredStudyTest : public ServiceTest {
 protected:
  /// Returns a submission of a study with mu = 0, 0.1, ..., 1 and a filter.
  ClientRequest filtered_request(const std::string& where) {
    ClientRequest message = submit_request("filtered");
    *message.mutable_submit()->mutable_recipe() = protocol::recipe_of_blocks(
        {protocol::filtered({protocol::listed("H", {0.5}), protocol::range("mu", 0.0, 1.0, 11),
                             protocol::listed("e", {1.0})},
                            where)});
    return message;
  }
  void submit_filtered() {
    request(filtered_request("mu > 0.75"));
    run_checks();
    write_all();
  }
};

TEST_F(FilteredStudyTest, PointsAreValidatedOnTheCheckThread) {
  request(filtered_request("mu > 0.75"));
  EXPECT_THAT(ports_.replies, IsEmpty());
  ASSERT_EQ(ports_.checks.size(), 1U);
  run_checks();
  write_all();
  EXPECT_EQ(last_reply().submit().points(), 11U);
  EXPECT_EQ(status_of("filtered").points(), 11U);
  EXPECT_EQ(status_of("filtered").left_out(), 0U) << "no worker has reported left-out points yet";
  request(filtered_request("mu >"));
  EXPECT_THAT(ports_.checks, IsEmpty()) << "an invalid filter is refused without a check";
  EXPECT_THAT(last_error(), HasSubstr("where"));
}

TEST_F(FilteredStudyTest, TracesOfAFilteredStudyUseThePointNumbers) {
  submit_filtered();
  hello();
  const auto trace_reply = [&](std::uint64_t point) {
    ports_.replies.clear();
    ClientRequest message = client_request(7);
    message.mutable_trace()->set_study("filtered");
    message.mutable_trace()->set_point(point);
    message.mutable_trace()->set_only_point(true);
    request(message);
    return last_reply();
  };
  EXPECT_NEAR(trace_reply(9).trace().mu(), 0.9, 1e-12);
  EXPECT_THAT(trace_reply(3).error().message(),
              HasSubstr("point 3 is left out by the study's filter"));
  EXPECT_THAT(trace_reply(11).error().message(), HasSubstr("its points are 0 to 10"));
}

TEST_F(FilteredStudyTest, TheWorkerReportsLeftOutPointsAndSolvesTheOthers) {
  submit_filtered();
  hello_and_credit();
  while (last_message().has_batch()) {
    answer_batch(100);
    credit(1);
  }
  const auto status = status_of("filtered");
  EXPECT_EQ(status.state(), "done");
  EXPECT_EQ(status.solved(), 3U);
  EXPECT_EQ(status.left_out(), 8U);
}

TEST_F(FilteredStudyTest, InvalidRangesEndTheConnection) {
  submit_filtered();
  // Each invalid range ends the connection of its worker.
  const std::vector<std::vector<std::uint64_t>> wrong{
      {0, 12}, {11, 1}, {0}, {0, 0}, {3, ~std::uint64_t{0}}, {~std::uint64_t{0}, 2}, {0, 1, 5}};
  for (const auto& numbers : wrong) {
    hello();
    credit(1);
    ASSERT_TRUE(last_message().has_batch());
    WorkerMessage message;
    auto& results = *message.mutable_results();
    results.set_study_id(1);
    results.set_study_uid(uid_of(1));
    results.set_lease_id(last_message().batch().lease_id());
    results.set_batch_done(true);
    results.mutable_left_out()->Assign(numbers.begin(), numbers.end());
    worker_sends(message);
    write_all();
    EXPECT_EQ(service_->scheduler().workers(), 0U);
    EXPECT_EQ(status_of("filtered").left_out(), 0U);
  }
}

TEST_F(FilteredStudyTest, AValueThatIsNotAllowedIsAnErrorWithThePoint) {
  ClientRequest message = filtered_request("");
  *message.mutable_submit()->mutable_recipe() = protocol::recipe_of(
      {{protocol::following("k", "1e7 * (0.55 - mu)"), protocol::listed("H", {0.5}),
        protocol::range("mu", 0.0, 1.0, 11), protocol::listed("e", {1.0})}});
  request(message);
  run_checks();
  EXPECT_THAT(last_error(), HasSubstr("point 6: k = "));
}

}  // namespace
}  // namespace oblique::server
