#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/point_table.h"

namespace oblique::worker {

/// A batch with all that solving it needs. Its points are reached by their positions in the order
/// in which they are to be solved, from 0 to size().
class Batch {
 public:
  /// Points that follow each other, without the end.
  struct Range {
    std::uint64_t begin;
    std::uint64_t end;
  };
  /// `number` counts this worker's batches: lease numbers may come again, these do not. Batches of
  /// a higher priority are solved first.
  Batch(std::uint64_t number, std::uint64_t study_id, const std::vector<Range>& ranges,
        std::shared_ptr<const protocol::PointTable> points);

  std::uint64_t number() const { return number_; }
  std::uint64_t study_id() const { return study_id_; }
  const protocol::PointTable& points() const { return *points_; }

  std::uint64_t size() const { return size_; }
  std::uint64_t point_at(std::uint64_t position) const;
  /// The first position of [at, end) whose point a filter leaves in, or `end`.
  std::uint64_t first_to_solve(std::uint64_t at, std::uint64_t end) const;
  /// Appends the points at the positions [begin, end) to `ranges`, the last of which may grow.
  void append_points(std::uint64_t begin, std::uint64_t end, std::vector<Range>& ranges) const;
  /// The position behind the points from `position` on that follow each other and share a model.
  std::uint64_t end_of_model(std::uint64_t position) const;

 private:
  struct Run {
    std::uint64_t position;
    std::uint64_t point;
  };
  std::size_t run_of(std::uint64_t position) const;
  std::uint64_t end_of_run(std::size_t run) const;

  std::uint64_t number_;
  std::uint64_t study_id_;
  std::vector<Run> runs_;  ///< by position; up to the position of the next one
  std::uint64_t size_ = 0;
  std::shared_ptr<const protocol::PointTable> points_;
};

/// The ranges of a message; nothing unless each has points, all of a study of `study_points`, and
/// together not more.
std::optional<std::vector<Batch::Range>> ranges_of(const protocol::Batch& message,
                                                   std::uint64_t study_points);

/// Points of one batch that were solved or found to be left out since the last report of it.
struct Progress {
  std::uint64_t batch;
  std::uint64_t study_id;
  std::vector<protocol::PointResult> results;
  double busy_s;                         ///< time spent on them
  bool batch_done;                       ///< no more will come
  std::vector<Batch::Range> left_out{};  ///< points that a filter leaves out
};

}  // namespace oblique::worker
