#pragma once

#include <cstdint>
#include <map>

#include "server/study/interval_set.h"

namespace oblique::server {

/// How often points were leased. Intervals of points with equal numbers are stored, so the cost
/// grows with the number of intervals, not of points.
class PointAttempts {
 public:
  /// Sets the number for the points of `range`, and replaces earlier ones.
  void set(const Interval& range, std::uint32_t attempts);

  bool empty() const { return counts_.empty(); }

  /// Calls `visit` with every interval and its number, in order of the points.
  template <typename Visitor>
  void for_each(Visitor visit) const {
    for (const auto& [begin, counted] : counts_) {
      visit(Interval{begin, counted.end}, counted.attempts);
    }
  }

 private:
  struct Counted {
    std::uint64_t end;
    std::uint32_t attempts;
  };
  void make_room(const Interval& range);

  std::map<std::uint64_t, Counted> counts_;  // by first point
};

}  // namespace oblique::server
