#include "server/web/answers/point_set.h"

#include <algorithm>

namespace oblique::server {

bool PointSet::add(std::uint64_t point) {
  if (!runs_.empty() && point < runs_.back().end) {
    return false;
  }
  if (!runs_.empty() && point == runs_.back().end) {
    ++runs_.back().end;
    return true;
  }
  if (runs_.size() == kMostRuns) {
    return false;
  }
  runs_.push_back({point, point + 1});
  return true;
}

bool PointSet::has(std::uint64_t point, std::size_t& near) const {
  const auto is_at = [&](std::size_t run) {  // the first run that ends behind the point
    return run < runs_.size() && point < runs_[run].end &&
           (run == 0 || runs_[run - 1].end <= point);
  };
  if (!is_at(near)) {
    near = is_at(near + 1) ? near + 1
                           : static_cast<std::size_t>(
                                 std::upper_bound(runs_.begin(), runs_.end(), point,
                                                  [](std::uint64_t value, const PointRun& run) {
                                                    return value < run.end;
                                                  }) -
                                 runs_.begin());
  }
  return near < runs_.size() && runs_[near].begin <= point;
}

}  // namespace oblique::server
