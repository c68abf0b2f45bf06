#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "server/scheduler/study_points.h"

namespace oblique::server {

/// The leases of one study by their first points, so that those of some points are found without
/// looking at all.
class LeaseIndex {
 public:
  using LeaseId = std::uint64_t;

  void insert(LeaseId lease, const Batch& batch) {
    by_point_.emplace(batch.first_place, lease);
    longest_ = std::max(longest_, batch.count);
  }
  void erase(LeaseId lease, const Batch& batch) {
    by_point_.erase({batch.first_place, lease});
    longest_ = by_point_.empty() ? 0 : longest_;
  }

  bool empty() const { return by_point_.empty(); }
  std::size_t size() const { return by_point_.size(); }

  /// All of them, in the order of their points.
  std::vector<LeaseId> all() const {
    std::vector<LeaseId> leases;
    leases.reserve(by_point_.size());
    for (const auto& [first, lease] : by_point_) {
      leases.push_back(lease);
    }
    return leases;
  }

  /// Those that may have points of the batch: all that do, and some others near it.
  std::vector<LeaseId> near(const Batch& batch) const {
    const std::uint64_t from = batch.first_place - std::min(batch.first_place, longest_);
    std::vector<LeaseId> leases;
    for (auto at = by_point_.lower_bound({from, 0});
         at != by_point_.end() && at->first < batch.end(); ++at) {
      leases.push_back(at->second);
    }
    return leases;
  }

 private:
  std::set<std::pair<std::uint64_t, LeaseId>> by_point_;
  std::uint64_t longest_ = 0;  // of any batch since there was none
};

}  // namespace oblique::server
