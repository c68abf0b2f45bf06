#pragma once

#include <atomic>

namespace oblique::solver {

/// How far a fall is while it is solved, for whoever waits for it in another thread.
class FallProgress {
 public:
  /// Called by who solves the fall, after each step or now and then: two stores.
  void reach(double t_s, double drop_m) {
    t_s_.store(t_s, std::memory_order_relaxed);
    drop_m_.store(drop_m, std::memory_order_relaxed);
  }

  /// Since release [s]; 0 before the fall is begun.
  double time_s() const { return t_s_.load(std::memory_order_relaxed); }
  /// Of the tip [m].
  double drop_m() const { return drop_m_.load(std::memory_order_relaxed); }

 private:
  std::atomic<double> t_s_{0.0};
  std::atomic<double> drop_m_{0.0};
};

}  // namespace oblique::solver
