#pragma once

#include <cstddef>
#include <cstdint>

#include "proto/oblique.pb.h"

namespace oblique::client {

/// How many jobs a cluster should run; help texts print the defaults from here.
struct JobLimits {
  std::size_t least = 0;                  ///< jobs, even without open points
  std::size_t most = 1;                   ///< jobs; not below `least`
  std::uint64_t points_per_job = 10'000;  ///< open points for each of which a job is wanted
};

/// Points that more workers would help to solve: those of running studies, unless a study waits for
/// something else, such as a full disk.
std::uint64_t open_points(const protocol::StatusReply& status);

/// Number of jobs to submit: one for every `points_per_job` open points, rounded up and within the
/// limits, less the jobs that are pending or running.
std::size_t jobs_to_submit(std::uint64_t open_points, std::size_t jobs, const JobLimits& limits);

}  // namespace oblique::client
