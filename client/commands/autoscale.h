#pragma once

#include <cstddef>
#include <cstdint>

#include "proto/oblique.pb.h"

namespace oblique::client {

/// Limits for the number of jobs on a cluster. Help texts print these defaults.
struct JobLimits {
  std::size_t least = 0;                  ///< minimum number of jobs, even without open points
  std::size_t most = 1;                   ///< maximum number of jobs; not below `least`
  std::uint64_t points_per_job = 10'000;  ///< open points per job
};

/// Returns the number of open points that more workers would help to solve: the open points of
/// running studies. Studies that wait for something other than workers, such as disk space, do not
/// count.
std::uint64_t open_points(const protocol::StatusReply& status);

/// Returns the number of jobs to submit: one per `points_per_job` open points, rounded up and
/// within the limits, minus the pending and running jobs.
std::size_t jobs_to_submit(std::uint64_t open_points, std::size_t jobs, const JobLimits& limits);

}  // namespace oblique::client
