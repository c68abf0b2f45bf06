#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

namespace oblique::client {

/// What jobs are good for.
struct Capacity {
  std::optional<double> points_per_s_a_thread{};  ///< none: not measured yet
  std::optional<double> threads_a_job{};          ///< none: no worker of a job was seen yet
  std::size_t other_threads = 0;                  ///< of workers that belong to no job of ours
};

/// How many jobs settle `open_points` in `target_s`, beside the workers that belong to none: none
/// without open points, and never more than have a point for each thread. While there is no measure
/// of what a job does it takes one to find out, or the `jobs_now` that are there.
std::size_t jobs_needed(std::uint64_t open_points, const Capacity& capacity, double target_s,
                        std::size_t jobs_now);

}  // namespace oblique::client
