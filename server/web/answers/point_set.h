#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/web/answers/column_store.h"

namespace oblique::server {

/// Points of a study, as runs of those that follow each other.
class PointSet {
 public:
  /// A higher point than all before. False, and nothing is added: it is none, or there are
  /// `kMostRuns` already.
  bool add(std::uint64_t point);

  std::size_t runs() const { return runs_.size(); }
  /// `near` is where the last answer was found, 0 at first: who asks in the order of points is
  /// answered at once.
  bool has(std::uint64_t point, std::size_t& near) const;

  /// 16 bytes each. A million points have half as many at most.
  static constexpr std::size_t kMostRuns = std::size_t{4} << 20U;

 private:
  std::vector<PointRun> runs_;
};

}  // namespace oblique::server
