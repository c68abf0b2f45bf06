#pragma once

#include <cstdint>
#include <vector>

#include "proto/recipe/point_table.h"
#include "server/study/interval_set.h"

namespace oblique::server {

/// The order in which the points of a study are leased. A fall is the motion until the tip touches
/// the ground; a worker computes it once for all points that share it. A *place* is a position in
/// the order, from 0.
///
/// Places equal point numbers until `arrange` is called for a study in which points of one fall are
/// not adjacent. `arrange` puts falls into groups that a worker solves side by side. A group begins
/// with one point of each fall, so that the first batch contains all falls; its other points
/// follow, fall by fall. Needs 20 bytes for each run of adjacent points with the same model.
class PointOrder {
 public:
  /// Maximum number of models of an arranged study. Finding falls takes about a microsecond a
  /// model.
  static constexpr std::uint64_t kMaxModels = 1'000'000;

  /// Orders the points from `first` on if points of one fall are not adjacent. `first` is 0 or the
  /// number of ordered points. `open` contains the points that may be leased. Each group has
  /// `falls_a_group` falls with open points; the last group may have fewer.
  void arrange(const protocol::PointTable& table, std::uint64_t first, const IntervalSet& open,
               std::uint64_t falls_a_group);
  bool is_arranged() const { return end_ > 0; }

  std::uint64_t place(std::uint64_t point) const;
  std::uint64_t point(std::uint64_t place) const;
  /// Returns the points at these places, in order of the places; adjacent points form one interval.
  std::vector<Interval> points(const Interval& places) const;
  /// Returns the places of these points.
  IntervalSet places(const IntervalSet& points) const;
  /// Returns the places of the group around `place`. Without groups, returns the places around it
  /// whose points have the same model.
  Interval group_at(const protocol::PointTable& table, std::uint64_t place) const;

 private:
  /// A run of consecutive points at consecutive places. It ends at the place of the next run.
  struct Run {
    std::uint64_t place;
    std::uint64_t point;
  };
  void append(const Interval& points);
  std::uint64_t end_of_run(std::size_t run) const;
  std::size_t run_of_place(std::uint64_t place) const;

  std::vector<Run> runs_;                ///< sorted by place
  std::vector<std::uint32_t> by_point_;  ///< indices of runs, sorted by point
  std::vector<std::uint64_t> groups_;    ///< first place of each group
  std::uint64_t end_ = 0;  ///< place after all runs; from here on the point number is the place
};

}  // namespace oblique::server
