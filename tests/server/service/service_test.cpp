// Tests of studies and workers, message by message: acknowledgements and refused peers.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include "proto/recipe/point_table.h"
#include "proto/result_message.h"
#include "proto/wire/frame_scan.h"
#include "tests/server/service/service_fixture.h"

namespace oblique::server {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

TEST_F(ServiceTest, AStudyIsAcknowledgedOnlyOnceItIsStored) {
  request(submit_request("a"));
  EXPECT_TRUE(ports_.replies.empty());
  write_all();
  const auto reply = last_reply();
  EXPECT_EQ(reply.request_id(), 42U);
  EXPECT_EQ(reply.submit().points(), 10U);
  EXPECT_TRUE(reply.submit().created());
}

TEST_F(ServiceTest, ClientsGetAnErrorWhenTheDatabaseStoresNothingForSeconds) {
  submit("a");
  const std::size_t replies = ports_.replies.size();
  request(submit_request("b"));
  service_->tick(now_);
  now_.steady_ms += 4999;
  service_->tick(now_);
  request(submit_request("b"));
  EXPECT_EQ(ports_.replies.size(), replies)
      << "the server waits some seconds for the database before it refuses";
  now_.steady_ms += 1;
  service_->tick(now_);
  request(submit_request("b"));
  EXPECT_THAT(last_error(), HasSubstr("stored nothing for over 5 s"));
  EXPECT_THAT(status_of("a").waits_for(), HasSubstr("stored nothing for over 5 s"));
  write_all();
  service_->tick(now_);
  EXPECT_EQ(status_of("a").waits_for(), "a worker");
}

TEST_F(ServiceTest, StatusShowsThatTheOnlyWorkerHasStalled) {
  submit("a", 1);
  hello_and_credit();
  for (int second = 0; second < 80; ++second) {
    now_.steady_ms += 1000;
    credit(0);
    service_->tick(now_);
  }
  EXPECT_EQ(status_of("a").waits_for(), "a worker");
}

TEST_F(ServiceTest, AStudyThatCouldNotBeStoredIsRefusedAndItsNameIsFree) {
  request(submit_request("a"));
  write_all("the disk is full");
  EXPECT_THAT(last_error(), HasSubstr("the disk is full"));
  EXPECT_EQ(last_reply().error().code(), protocol::ERROR_CODE_FAILED);
  submit("a", 20);
  EXPECT_EQ(last_reply().submit().points(), 20U);
}

TEST_F(ServiceTest, InvalidStudiesAreRefusedWithTheReason) {
  const auto error_of = [&](const auto& make_invalid) {
    ClientRequest message = submit_request("a");
    make_invalid(*message.mutable_submit());
    request(message);
    EXPECT_EQ(last_reply().error().code(), protocol::ERROR_CODE_WRONG_REQUEST);
    return last_error();
  };
  EXPECT_THAT(error_of([](auto& study) { study.set_name(""); }), HasSubstr("1 to 100 bytes"));
  EXPECT_THAT(error_of([](auto& study) { study.set_name("a\nb"); }),
              HasSubstr("control characters"));
  EXPECT_THAT(error_of([](auto& study) {
                study.mutable_recipe()->mutable_blocks(0)->mutable_axes(2)->set_values(0, 1.5);
              }),
              HasSubstr("e = 1.5"));
  EXPECT_THAT(error_of([](auto& study) { study.set_priority(100'000); }),
              HasSubstr("priority = 100000"));
  EXPECT_THAT(error_of([](auto& study) { study.mutable_recipe()->clear_model(); }),
              HasSubstr("the recipe has no model"));
  EXPECT_TRUE(ports_.jobs.empty());
}

TEST_F(ServiceTest, AWorkerIsWelcomedByNumberAndItsHeartbeatsAreAnswered) {
  credit(1);
  EXPECT_TRUE(last_message().has_hello_again()) << "an unknown worker";
  hello();
  EXPECT_EQ(last_message().welcome().worker_id(), 1U);
  EXPECT_EQ(last_message().welcome().database_id(), "db");
  EXPECT_EQ(last_message().welcome().lost_after_ms(), 2800U);
  WorkerMessage message;
  message.mutable_heartbeat();
  worker_sends(message);
  EXPECT_TRUE(last_message().has_heartbeat_reply());
}

TEST_F(ServiceTest, ASecondHelloStartsANewSession) {
  submit("a");
  hello_and_credit();
  ASSERT_TRUE(last_message().has_batch());
  hello();
  EXPECT_EQ(service_->scheduler().workers(), 1U);
  EXPECT_EQ(service_->scheduler().study(1).leased, 0U);
}

TEST_F(ServiceTest, ResultsAreAcknowledgedWhenTheyAreStored) {
  submit("a", 1);
  hello_and_credit();
  WorkerMessage message = results_of({0}, 1, last_message().batch().lease_id());
  message.mutable_results()->set_batch_done(true);
  worker_sends(message);
  ASSERT_EQ(ports_.jobs.size(), 2U) << "expected one row of the worker and one of the results";
  EXPECT_FALSE(last_message().has_results_stored());
  write_all();
  EXPECT_EQ(last_message().results_stored().sequence(), sequence_);
  // The service stores that the study is done.
  ASSERT_EQ(ports_.jobs.size(), 1U);
  EXPECT_EQ(std::get<SetStudyState>(ports_.jobs[0].change).state, StudyState::kDone);
}

TEST_F(ServiceTest, AResultThatIsNotFiniteOrOfOtherInputsThanItsPointBecomesAFailedPoint) {
  submit("a", 3);
  hello_and_credit();
  WorkerMessage message = results_of({0, 1, 2}, 1, last_message().batch().lease_id());
  auto& results = *message.mutable_results()->mutable_results();
  results.at(0).set_h_m(std::nextafter(results.at(0).h_m(), 2.0));
  results.at(1).set_h_m(1.001 * results.at(1).h_m());
  results.at(2).set_reals(4, std::numeric_limits<double>::quiet_NaN());
  worker_sends(message);
  ASSERT_EQ(ports_.jobs.size(), 2U) << "expected one row of the worker and one of the results";
  const auto& change = std::get<AddResults>(ports_.jobs[1].change);
  EXPECT_EQ(change.results.at(0).error(), "") << "inputs may differ by rounding";
  EXPECT_THAT(change.results.at(1).error(), HasSubstr("H = 1.00"));
  EXPECT_THAT(change.results.at(2).error(), HasSubstr("duration_s"));
  write_all();
  EXPECT_EQ(service_->scheduler().study(1).failed, 2U);
}

TEST_F(ServiceTest, ResultsForAnotherStudyOfTheSameNumberAreAcknowledgedCountedAndNotStored) {
  const protocol::Recipe one_model = table_of(4)->recipe();
  protocol::Recipe models = one_model;
  protocol::Axis& k = *models.mutable_blocks(0)->add_axes();
  k = protocol::listed("k", {2e7, 3e7});
  for (int i = models.blocks(0).axes_size() - 1; i > 0; --i) {  // model keys come first
    models.mutable_blocks(0)->mutable_axes()->SwapElements(i, i - 1);
  }
  submit("a", one_model);
  submit("b", models);
  hello_and_credit();
  const std::uint64_t lease = last_message().batch().lease_id();
  const auto expect_ignored = [&](WorkerMessage message, std::uint64_t ignored) {
    const std::uint64_t before = service_->stored_points().ignored;
    worker_sends(message);
    ASSERT_EQ(ports_.jobs.size(), 1U);
    EXPECT_TRUE(std::get<AddResults>(ports_.jobs[0].change).results.empty());
    write_all();
    EXPECT_EQ(last_message().results_stored().sequence(), message.results().sequence());
    EXPECT_EQ(service_->stored_points().ignored - before, ignored);
  };
  for (const std::uint64_t held : {std::uint64_t{0}, lease}) {
    WorkerMessage other_uid = results_of({0, 1}, 1, held);
    other_uid.mutable_results()->set_study_uid("other");
    expect_ignored(other_uid, 2);
  }
  WorkerMessage other_H = results_of({1});
  other_H.mutable_results()->mutable_results(0)->set_h_m(1.001);
  expect_ignored(other_H, 1);
  WorkerMessage other_k = results_of({1}, 2);
  other_k.mutable_results()->mutable_results(0)->mutable_model()->set_k_n_m(4e7);
  expect_ignored(other_k, 1);
  for (const StudyId study : {1U, 2U}) {
    EXPECT_EQ(service_->scheduler().study(study).completed, 0U);
    EXPECT_EQ(service_->scheduler().study(study).failed, 0U);
  }
  WorkerMessage mixed = results_of({0, 1, 2});
  mixed.mutable_results()->mutable_results(0)->set_mu(0.77);
  worker_sends(mixed);
  const auto& stored = std::get<AddResults>(ports_.jobs.back().change).results;
  ASSERT_EQ(stored.size(), 2U);
  EXPECT_EQ(stored.at(0).point(), 1U);
  EXPECT_EQ(stored.at(1).point(), 2U);
  EXPECT_THAT(ports_.lines, testing::Contains(HasSubstr("1 results for another study than a")));
}

TEST_F(ServiceTest, InvalidFramesAreCountedAndClientsGetAnError) {
  service_->worker_frame("worker", "\xff\xff", now_);
  service_->worker_frame("worker", "", now_);
  EXPECT_EQ(service_->bad_frames(), 2U);
  EXPECT_TRUE(ports_.worker_messages.empty());
  service_->client_frame("client", "\xff\xff", now_);
  EXPECT_TRUE(last_reply().has_error());
  request(client_request());
  EXPECT_THAT(last_error(), HasSubstr("kind of request"));
}

TEST_F(ServiceTest, StatusHasTheRateOfTheLastSeconds) {
  submit("a", 1000);
  hello();
  std::vector<std::uint64_t> points(100);
  std::iota(points.begin(), points.end(), std::uint64_t{0});
  worker_sends(results_of(points));
  write_all();
  now_.steady_ms += 500;
  const auto status = status_of("a");
  EXPECT_EQ(status.solved(), 100U);
  EXPECT_DOUBLE_EQ(status.points_per_s(), 200.0);
  EXPECT_EQ(status.created_at(), "2023-11-14T22:13:20.123Z");
}

// ---- Peers of other versions, and incorrect peers ----

WorkerMessage hello_of(std::uint32_t protocol_version, const std::string& solver_version) {
  WorkerMessage message;
  protocol::set_protocol(*message.mutable_hello());
  message.mutable_hello()->set_protocol_version(protocol_version);
  message.mutable_hello()->set_solver_version(solver_version);
  message.mutable_hello()->set_threads(1);
  return message;
}

TEST_F(ServiceTest, AWorkerWithAnotherSolverOrOtherOutputsIsRefusedWithTheReason) {
  worker_sends(hello_of(protocol::kProtocolVersion, "0.9"));
  EXPECT_THAT(last_message().refused().reason(), AllOf(HasSubstr("0.9"), HasSubstr("1.0")));
  for (const std::string& outputs : {std::string(), protocol::sent_outputs() + " new_N"}) {
    WorkerMessage message = hello_of(protocol::kProtocolVersion, "1.0");
    message.mutable_hello()->set_outputs(outputs);
    worker_sends(message);
    EXPECT_THAT(last_message().refused().reason(), HasSubstr("other outputs"));
  }
  EXPECT_EQ(service_->scheduler().workers(), 0U);
}

TEST_F(ServiceTest, ARestoredStudyHasItsStateUnlessItsRowsAreLostOrOfAnotherSolver) {
  for (const auto state :
       {StudyState::kRunning, StudyState::kPaused, StudyState::kCancelled, StudyState::kDone}) {
    for (const std::uint64_t completed : {1U, 2U}) {
      StoredStudy stored{};
      stored.study_id = 1;
      stored.name = "a";
      stored.table = table_of(2);
      stored.state = state;
      stored.completed = IntervalSet(0, completed);
      stored.solver_version = "0.9";
      start({}, {stored});
      const bool lacks_rows = state == StudyState::kDone && completed < 2;
      EXPECT_EQ(service_->states().record(1).state, completed == 2 ? StudyState::kDone
                                                    : lacks_rows   ? StudyState::kRunning
                                                                   : state);
      EXPECT_EQ(status_of("a").waits_for().find("solver version 0.9") != std::string::npos,
                completed < 2 && (lacks_rows || state == StudyState::kRunning));
    }
  }
}

TEST_F(ServiceTest, AnotherPriorityIsAcknowledgedOnceItIsDurable) {
  submit("a");
  ClientRequest again = submit_request("a");
  again.mutable_submit()->set_priority(7);
  const std::size_t replies = ports_.replies.size();
  request(again);
  EXPECT_EQ(ports_.replies.size(), replies) << "the reply was sent before the priority was stored";
  write_all();
  EXPECT_TRUE(last_reply().has_submit());
  EXPECT_EQ(status_of("a").priority(), 7);
  again.mutable_submit()->set_priority(8);
  request(again);
  write_all("the disk is full");
  EXPECT_THAT(last_error(), HasSubstr("disk is full"));
}

TEST_F(ServiceTest, PeersOfAnyOtherProtocolVersionAreRefusedWithBothVersions) {
  const std::string own = fmt::format("version {}", protocol::kProtocolVersion);
  for (const std::uint32_t version :
       {0U, protocol::kProtocolVersion - 1, protocol::kProtocolVersion + 1, 77U}) {
    worker_sends(hello_of(version, "1.0"));
    EXPECT_THAT(last_message().refused().reason(),
                HasSubstr(fmt::format("{}, but the worker has version {}", own, version)));
    ClientRequest message = submit_request("a");
    message.set_protocol_version(version);
    request(message);
    EXPECT_THAT(
        last_error(),
        HasSubstr(version == 0 ? std::string("this port is for clients")
                               : fmt::format("{}, but the client has version {}", own, version)));
  }
  EXPECT_EQ(service_->scheduler().workers(), 0U);
}

TEST_F(ServiceTest, TextFromAWorkerCannotForgeLogLines) {
  WorkerMessage message = hello_of(protocol::kProtocolVersion, "1.0");
  message.mutable_hello()->set_name("a\n\x1b[31mb");
  worker_sends(message);
  EXPECT_THAT(ports_.lines.back(), HasSubstr("(a??[31mb, 1 threads) joins"));
}

TEST_F(ServiceTest, AWorkerWithALateHeartbeatAndALostConnectionIsDropped) {
  submit("a");
  hello_and_credit();
  ports_.unreachable = "worker";
  now_.steady_ms += 1000;
  service_->tick(now_);
  EXPECT_EQ(service_->scheduler().workers(), 1U);
  now_.steady_ms += 200;
  service_->tick(now_);
  EXPECT_EQ(service_->scheduler().workers(), 0U);
  EXPECT_EQ(service_->scheduler().study(1).leased, 0U);
}

TEST_F(ServiceTest, StatusShowsWhileTheDiskAcceptsNoResults) {
  submit("a");
  hello();
  service_->written({WriteReport::Kind::kFault, 0, "disk full"}, now_);
  EXPECT_THAT(status_of("a").waits_for(), HasSubstr("disk full"));
  service_->written({WriteReport::Kind::kRecovered, 0, {}}, now_);
  EXPECT_THAT(status_of("a").waits_for(), IsEmpty());
}

TEST_F(ServiceTest, TooLargeMessagesOfWorkersAreNotParsed) {
  WorkerMessage heartbeat;
  for (std::uint64_t i = 0; i <= protocol::kMaxLeasesAHeartbeat; ++i) {
    heartbeat.mutable_heartbeat()->add_lease_ids(i);
  }
  WorkerMessage results;
  for (std::size_t i = 0; i <= protocol::kMaxResultsAMessage; ++i) {
    results.mutable_results()->add_results();
  }
  worker_sends(heartbeat);
  EXPECT_EQ(service_->bad_frames(), 1U) << "a heartbeat of an unknown worker";
  for (const WorkerMessage& message : {heartbeat, results}) {
    hello();
    worker_sends(message);
    EXPECT_TRUE(last_message().has_hello_again());
    EXPECT_EQ(service_->scheduler().workers(), 0U);
  }
  EXPECT_EQ(service_->bad_frames(), 3U);
  EXPECT_TRUE(ports_.jobs.empty());
}

TEST_F(ServiceTest, AWorkerIsStoredWithItsFirstResult) {
  submit("a", 4);
  for (int i = 0; i < 1000; ++i) {
    hello("worker " + std::to_string(i));
  }
  EXPECT_TRUE(ports_.jobs.empty());
  hello_and_credit();
  worker_sends(results_of({0}));
  worker_sends(results_of({0}));
  ASSERT_EQ(ports_.jobs.size(), 3U) << "expected one row of the worker and two messages of results";
  EXPECT_EQ(std::get<AddWorker>(ports_.jobs[0].change).worker_id, 1001U);
  EXPECT_EQ(std::get<AddResults>(ports_.jobs[1].change).worker_id, 1001U);
}

TEST_F(ServiceTest, WorkersThatReconnectAgainAndAgainDoNotFillTheLog) {
  WorkerMessage goodbye;
  goodbye.mutable_goodbye();
  for (int i = 0; i < 10'000; ++i) {
    hello("worker " + std::to_string(i));
    worker_sends(goodbye, "worker " + std::to_string(i));
  }
  EXPECT_EQ(ports_.lines.size(), 20U);
  ports_.lines.clear();
  now_.steady_ms += 10'000;
  service_->tick(now_);
  hello();
  ASSERT_EQ(ports_.lines.size(), 2U);
  EXPECT_THAT(ports_.lines[0], HasSubstr("and 19980 more lines"));
  EXPECT_THAT(ports_.lines[1], HasSubstr("joins"));
}

TEST_F(ServiceTest, PagesOfStudiesContainEachStudyOnce) {
  constexpr int kStudies = 2500;
  for (int i = 0; i < kStudies; ++i) {
    service_->client_frame("client", protocol::encode(submit_request(std::to_string(i))), now_);
  }
  write_all();
  std::uint64_t after = 0;
  int seen = 0;
  for (const int size : {1000, 1000, 500}) {
    const auto page = statuses(after);
    ASSERT_EQ(page.studies_size(), size);
    for (const auto& study : page.studies()) {
      EXPECT_GT(study.study_id(), after);
      after = study.study_id();
    }
    seen += size;
    EXPECT_EQ(page.next_after(), seen < kStudies ? after : 0U);
  }
  EXPECT_EQ(statuses(0, 10).studies_size(), 10);
  EXPECT_EQ(statuses(0, 1'000'000).studies_size(), 1000);
}

// ---- Worker processes ----

class ProcessesTest : public ServiceTest {
 protected:
  /// Says hello as the process `process_id`, which replaces the process of `ended`.
  void hello_as(const std::string& identity, const std::string& process_id,
                const protocol::EndedProcess& ended = {}) {
    WorkerMessage message = hello_of(protocol::kProtocolVersion, "1.0");
    message.mutable_hello()->set_process_id(process_id);
    *message.mutable_hello()->mutable_replaced() = ended;
    worker_sends(message, identity);
  }
};

TEST_F(ProcessesTest, TheStatusOfAWorkerCountsTheLossesOfItsProcess) {
  submit("a", 100);
  hello_as("first", "process 1");
  credit(2, "first");
  hello_as("second", "process 1");
  EXPECT_EQ(workers().workers(0).losses(), 2U);
}

TEST_F(ProcessesTest, APointOnWhichTheSolverCrashedTwiceFailsWithTheSignal) {
  submit("a", 1);
  hello_as("0", "process 0");
  credit(1, "0");
  for (const int life : {1, 2}) {
    protocol::EndedProcess ended;
    ended.set_process_id("process " + std::to_string(life - 1));
    ended.set_signal(11);
    ended.add_points(1);
    ended.add_points(0);
    hello_as(std::to_string(life), "process " + std::to_string(life), ended);
    credit(1, std::to_string(life));
    EXPECT_EQ(last_message().has_batch(), life == 1);
  }
  const auto* const change = std::get_if<AddResults>(&ports_.jobs.at(0).change);
  ASSERT_NE(change, nullptr);
  EXPECT_EQ(change->results.at(0).error(), "the solver crashed on this point: signal 11, twice");
  write_all();
  EXPECT_EQ(status_of("a").failed(), 1U);
  EXPECT_EQ(workers().workers(0).losses(), 2U);
}

}  // namespace
}  // namespace oblique::server
