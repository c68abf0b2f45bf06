#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "proto/oblique.pb.h"

namespace oblique::client {

/// The workers of one job, as the server knows them.
struct JobWorkers {
  std::size_t workers = 0;
  std::size_t threads = 0;
  std::uint64_t leased_points = 0;
};

/// What a server has to do, and who does it.
struct Demand {
  /// Not settled, of studies that run and wait for nothing but workers.
  std::uint64_t open_points = 0;
  std::uint64_t settled_points = 0;  ///< solved or failed, of all studies
  double points_per_s = 0.0;         ///< over the last seconds
  std::size_t threads = 0;           ///< of all workers
  std::map<std::string, JobWorkers> jobs;
  /// Studies that new workers would not help, each with what it waits for.
  std::vector<std::string> blocked;
};

/// The job that a worker of that name belongs to, if any.
using JobOfWorker = std::function<std::optional<std::string>(const std::string& worker)>;

/// What the answers of a server say. The replies are of all studies and all workers.
Demand demand_of(const protocol::StatusReply& studies, const protocol::WorkersReply& workers,
                 const JobOfWorker& job_of_worker);

}  // namespace oblique::client
