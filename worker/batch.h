#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/point_table.h"

namespace oblique::worker {

/// Points that follow each other, the end out.
struct BatchPart {
  std::uint64_t begin;
  std::uint64_t end;
};

/// A batch with all that solving it needs.
struct Batch {
  std::uint64_t
      number;  ///< counts this worker's batches; lease numbers may come again, these do not
  std::uint64_t study_id;
  std::uint64_t first_point;
  std::uint64_t count;
  std::shared_ptr<const protocol::PointTable> points;
  std::vector<BatchPart> parts{};  ///< rising and apart, what is to be solved of it; empty: all
  std::int32_t priority = 0;       ///< those of a higher one are solved first

  /// The first point of [at, end) that is to be solved, or `end`.
  std::uint64_t first_to_solve(std::uint64_t at, std::uint64_t end) const;
};

/// The parts that a message tells, of a batch that begins with `first_point`; nothing when they are
/// not `count` points together, or no parts at all.
std::optional<std::vector<BatchPart>> parts_of(const protocol::Batch& message);

/// How many points of a batch are to be solved. Where there is a filter so many numbers are looked
/// at, which is more than a server puts into a batch.
std::uint64_t points_to_solve(const Batch& batch);

/// Points of one batch that were solved since the last report of it.
struct Progress {
  std::uint64_t batch;
  std::uint64_t study_id;
  std::vector<protocol::PointResult> results;
  double busy_s;    ///< time spent solving them
  bool batch_done;  ///< no more will come
};

}  // namespace oblique::worker
