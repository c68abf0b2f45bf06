#pragma once

#include <cstdint>
#include <map>

#include "server/scheduler/interval_set.h"

namespace oblique::server {

/// How often points were leased, kept as runs of neighbours with one number: the cost grows with
/// the number of runs, not of points.
class AttemptRuns {
 public:
  /// The points of `range` were leased `attempts` times, whatever was said of them before.
  void set(const Interval& range, std::uint32_t attempts);

  bool empty() const { return runs_.empty(); }

  /// Calls `visit` with every run and its number, in order of the points.
  template <typename Visitor>
  void for_each(Visitor visit) const {
    for (const auto& [begin, run] : runs_) {
      visit(Interval{begin, run.end}, run.attempts);
    }
  }

 private:
  struct Run {
    std::uint64_t end;
    std::uint32_t attempts;
  };
  void make_room(const Interval& range);

  std::map<std::uint64_t, Run> runs_;  // by first point
};

}  // namespace oblique::server
