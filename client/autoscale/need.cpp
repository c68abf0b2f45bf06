#include "client/autoscale/need.h"

#include <algorithm>
#include <cmath>

namespace oblique::client {

std::size_t jobs_needed(std::uint64_t open_points, const Capacity& capacity, double target_s,
                        std::size_t jobs_now) {
  if (open_points == 0) {
    return 0;
  }
  if (!capacity.points_per_s_a_thread) {
    return std::max<std::size_t>(1, jobs_now);
  }
  // threads = points / (target_s points_per_s_a_thread), and a point for each
  const auto open = static_cast<double>(open_points);
  const double threads = std::min(open, open / (target_s * *capacity.points_per_s_a_thread)) -
                         static_cast<double>(capacity.other_threads);
  if (threads <= 0.0) {
    return 0;
  }
  if (!capacity.threads_a_job) {
    return std::max<std::size_t>(1, jobs_now);
  }
  constexpr double kMany = 1e9;
  return static_cast<std::size_t>(std::min(kMany, std::ceil(threads / *capacity.threads_a_job)));
}

}  // namespace oblique::client
