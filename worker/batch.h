#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/point_table.h"

namespace oblique::worker {

/// A batch with the points of its study. Positions, from 0 to size(), number its points in the
/// order in which they are solved.
class Batch {
 public:
  /// The points from `begin` to `end` - 1.
  struct Range {
    std::uint64_t begin;
    std::uint64_t end;
  };
  /// `number` is unique in this worker; lease numbers are not, after a restart of the server.
  Batch(std::uint64_t number, std::uint64_t study_id, const std::vector<Range>& ranges,
        std::shared_ptr<const protocol::PointTable> points);

  std::uint64_t number() const { return number_; }
  std::uint64_t study_id() const { return study_id_; }
  const protocol::PointTable& points() const { return *points_; }

  std::uint64_t size() const { return size_; }
  std::uint64_t point_at(std::uint64_t position) const {
    return points_from(position, size_).begin;
  }
  /// The first position in [at, end) whose point the filter keeps, or `end`.
  std::uint64_t first_to_solve(std::uint64_t at, std::uint64_t end) const;
  /// Appends the points at the positions [begin, end) to `ranges`; the last range may grow.
  void append_points(std::uint64_t begin, std::uint64_t end, std::vector<Range>& ranges) const;
  /// The position after consecutive points, from `position` on, of one model.
  std::uint64_t end_of_model(std::uint64_t position) const;

 private:
  struct Run {
    std::uint64_t position;
    std::uint64_t point;
  };
  /// Consecutive points from `position` on, at most up to the position `end`.
  Range points_from(std::uint64_t position, std::uint64_t end) const;

  std::uint64_t number_;
  std::uint64_t study_id_;
  std::vector<Run> runs_;  ///< each up to the position of the next one
  std::uint64_t size_ = 0;
  std::shared_ptr<const protocol::PointTable> points_;
};

/// The ranges of a message. Nothing unless each has points, all of a study of `study_points`, and
/// together no more than that.
std::optional<std::vector<Batch::Range>> ranges_of(const protocol::Batch& message,
                                                   std::uint64_t study_points);

/// Points of one batch that were solved or left out since the last report.
struct Progress {
  std::uint64_t batch;
  std::uint64_t study_id;
  std::vector<protocol::PointResult> results = {};
  double busy_s = 0.0;                      ///< time spent on them
  bool batch_done = false;                  ///< no more will come
  std::vector<Batch::Range> left_out = {};  ///< points that a filter leaves out
};

}  // namespace oblique::worker
