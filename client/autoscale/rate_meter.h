#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "client/autoscale/demand.h"

namespace oblique::client {

/// How often the rate is taken.
struct RateMeterSettings {
  double settle_s = 5.0;    ///< shortest time over which it is; 0: at once, from the server's
  double window_s = 300.0;  ///< longest time
};

/// How fast points are settled, a thread, while there is work for all threads and their number
/// stays the same. What was measured last counts until something better is known. The server's own
/// rate is over the last seconds, too short for points that take longer.
class RateMeter {
 public:
  explicit RateMeter(const RateMeterSettings& settings) : settings_(settings) {}

  void update(const Demand& demand, double now_s);
  /// What happens in between is not known, as when the server is away.
  void interrupt() { mark_.reset(); }

  /// None while nothing was measured. Threads that settle nothing for a while count as settling
  /// one point in that time, all together.
  std::optional<double> points_per_s_a_thread() const { return rate_; }

 private:
  /// Since when points are counted.
  struct Mark {
    double at_s;
    std::uint64_t settled_points;
    std::size_t threads;
  };

  RateMeterSettings settings_;
  std::optional<Mark> mark_;
  std::optional<double> rate_;
};

}  // namespace oblique::client
