#include "client/autoscale/demand.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace oblique::client {
namespace {

void add_study(protocol::StatusReply& reply, const std::string& state, std::uint64_t points,
               std::uint64_t solved, std::uint64_t failed, const std::string& waits_for = "") {
  auto& study = *reply.add_studies();
  study.set_name("s" + std::to_string(reply.studies_size()));
  study.set_state(state);
  study.set_points(points);
  study.set_solved(solved);
  study.set_failed(failed);
  study.set_points_per_s(10.0);
  study.set_waits_for(waits_for);
}

void add_worker(protocol::WorkersReply& reply, const std::string& name, std::uint32_t threads,
                std::uint64_t leased) {
  auto& worker = *reply.add_workers();
  worker.set_name(name);
  worker.set_threads(threads);
  worker.set_leased_points(leased);
}

std::optional<std::string> job_of(const std::string& name) {
  return name.starts_with("job-") ? std::optional(name.substr(4, 2)) : std::nullopt;
}

TEST(Demand, IsWhatIsOpenOfStudiesThatRun) {
  protocol::StatusReply studies;
  add_study(studies, "running", 100, 20, 5);
  add_study(studies, "running", 1000, 0, 0, "a worker");
  add_study(studies, "paused", 10'000, 0, 0);
  add_study(studies, "cancelled", 10'000, 100, 0);
  add_study(studies, "done", 7, 7, 0);
  const auto demand = demand_of(studies, {}, job_of);
  EXPECT_EQ(demand.open_points, 75U + 1000U);
  EXPECT_EQ(demand.settled_points, 25U + 100U + 7U);
  EXPECT_DOUBLE_EQ(demand.points_per_s, 20.0);
  EXPECT_TRUE(demand.blocked.empty());
}

TEST(Demand, LeavesOutWhatNoNewWorkerWouldHelp) {
  protocol::StatusReply studies;
  add_study(studies, "running", 100, 0, 0, "the database, which takes no results: disk full");
  const auto demand = demand_of(studies, {}, job_of);
  EXPECT_EQ(demand.open_points, 0U);
  EXPECT_THAT(demand.blocked,
              testing::ElementsAre(testing::HasSubstr("s1 waits for the database")));
}

TEST(Demand, KnowsTheWorkersOfEachJob) {
  protocol::WorkersReply workers;
  add_worker(workers, "job-12-n1", 8, 100);
  add_worker(workers, "job-12-n2", 8, 0);
  add_worker(workers, "laptop:4711", 2, 50);
  const auto demand = demand_of({}, workers, job_of);
  EXPECT_EQ(demand.threads, 18U);
  ASSERT_EQ(demand.jobs.size(), 1U);
  EXPECT_EQ(demand.jobs.at("12").workers, 2U);
  EXPECT_EQ(demand.jobs.at("12").threads, 16U);
  EXPECT_EQ(demand.jobs.at("12").leased_points, 100U);
}

}  // namespace
}  // namespace oblique::client
