#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "proto/recipe/point_table.h"

namespace oblique::worker {

/// A batch with all that solving it needs.
struct Batch {
  std::uint64_t
      number;  ///< counts this worker's batches; lease numbers may come again, these do not
  std::uint64_t study_id;
  std::uint64_t first_point;
  std::uint64_t count;
  std::shared_ptr<const protocol::PointTable> points;
};

/// How many points of a batch are to be solved. Where there is a filter so many numbers are looked
/// at, which is more than a server puts into a batch.
inline std::uint64_t points_to_solve(const protocol::PointTable& table, std::uint64_t first_point,
                                     std::uint64_t count) {
  constexpr std::uint64_t kMostLooks = 100'000;
  if (!table.has_filter() || count > kMostLooks) {
    return count;
  }
  std::uint64_t points = 0;
  const std::uint64_t end = first_point + count;
  for (std::uint64_t at = table.first_left_in(first_point, end); at < end;
       at = table.first_left_in(at + 1, end)) {
    ++points;
  }
  return points;
}

/// Points of one batch that were solved since the last report of it.
struct Progress {
  std::uint64_t batch;
  std::uint64_t study_id;
  std::vector<protocol::PointResult> results;
  double busy_s;    ///< time spent solving them
  bool batch_done;  ///< no more will come
};

}  // namespace oblique::worker
