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

/// Points of one batch that were solved since the last report of it.
struct Progress {
  std::uint64_t batch;
  std::uint64_t study_id;
  std::vector<protocol::PointResult> results;
  double busy_s;    ///< time spent solving them
  bool batch_done;  ///< no more will come
};

}  // namespace oblique::worker
