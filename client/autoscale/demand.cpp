#include "client/autoscale/demand.h"
#include "proto/study_counts.h"

#include <algorithm>

#include <spdlog/fmt/fmt.h>

namespace oblique::client {
namespace {

// As the server says it of a study that any worker would help.
constexpr const char* kAnyWorker = "a worker";

}  // namespace

Demand demand_of(const protocol::StatusReply& studies, const protocol::WorkersReply& workers,
                 const JobOfWorker& job_of_worker) {
  Demand demand;
  for (const auto& study : studies.studies()) {
    const std::uint64_t settled = std::min(study.points(), protocol::completed_points(study));
    demand.settled_points += settled;
    if (study.state() != "running") {
      continue;
    }
    demand.points_per_s += study.points_per_s();
    if (study.waits_for().empty() || study.waits_for() == kAnyWorker) {
      demand.open_points += study.points() - settled;
    } else {
      demand.blocked.push_back(fmt::format("{} waits for {}", study.name(), study.waits_for()));
    }
  }
  for (const auto& worker : workers.workers()) {
    demand.threads += worker.threads();
    if (const auto job = job_of_worker(worker.name())) {
      auto& of_job = demand.jobs[*job];
      ++of_job.workers;
      of_job.threads += worker.threads();
      of_job.leased_points += worker.leased_points();
    }
  }
  return demand;
}

}  // namespace oblique::client
