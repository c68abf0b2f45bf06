#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/point_table.h"

namespace oblique::worker {

/// A batch with the points of its study. Its points are solved in the order of their positions.
class Batch {
 public:
  /// The points from `begin` to `end` - 1.
  struct Range {
    std::uint64_t begin;
    std::uint64_t end;
  };
  /// `number` is unique in this worker. Lease numbers are not: a restarted server repeats them.
  /// `attempt` counts the leases of the points.
  Batch(std::uint64_t number, std::uint64_t study_id, const std::vector<Range>& ranges,
        std::shared_ptr<const protocol::PointTable> points, std::uint32_t attempt = 1,
        std::string study_uid = {});

  std::uint64_t number() const { return number_; }
  std::uint64_t study_id() const { return study_id_; }
  const std::string& study_uid() const { return study_uid_; }
  std::uint32_t attempt() const { return attempt_; }
  const protocol::PointTable& points() const { return *points_; }

  std::uint64_t size() const { return size_; }
  std::uint64_t point_at(std::uint64_t position) const {
    return points_from(position, size_).begin;
  }
  /// The first position in [at, end) whose point passes the filter, or `end`.
  std::uint64_t first_to_solve(std::uint64_t at, std::uint64_t end) const;
  /// Adds the points at the positions [begin, end) to `ranges`. May extend the last range.
  void append_points(std::uint64_t begin, std::uint64_t end, std::vector<Range>& ranges) const;
  /// Returns the end of the run of points of one model that begins at `position`.
  std::uint64_t end_of_model(std::uint64_t position) const;

 private:
  struct Run {
    std::uint64_t position;
    std::uint64_t point;
  };
  /// The range of consecutive points that begins at `position` and ends at or before `end`.
  Range points_from(std::uint64_t position, std::uint64_t end) const;

  std::uint64_t number_;
  std::uint64_t study_id_;
  std::string study_uid_;  ///< StudyDefinition.uid
  std::vector<Run> runs_;  ///< runs of consecutive points; each ends where the next begins
  std::uint64_t size_ = 0;
  std::shared_ptr<const protocol::PointTable> points_;
  std::uint32_t attempt_;
};

/// The ranges of a message. Returns nothing if a range is empty or not within a study of
/// `study_points`, or if the ranges together have more points than the study.
std::optional<std::vector<Batch::Range>> ranges_of(const protocol::Batch& message,
                                                   std::uint64_t study_points);

/// Points of one batch that were solved or left out since the last report.
struct Progress {
  std::uint64_t batch;
  std::uint64_t study_id;
  std::vector<protocol::PointResult> results = {};
  double busy_s = 0.0;                      ///< time spent on the results
  bool batch_done = false;                  ///< the batch has no further points
  std::vector<Batch::Range> left_out = {};  ///< points that did not pass the filter
  std::uint32_t attempt = 1;                ///< attempt of the batch
  std::string study_uid = {};               ///< StudyDefinition.uid
};

}  // namespace oblique::worker
