#pragma once

#include <cstdint>
#include <vector>

#include "proto/recipe/point_table.h"
#include "server/study/interval_set.h"

namespace oblique::server {

/// The order in which the points of a study are leased. A *place* is a position in this order, from
/// 0.
///
/// Places equal point numbers until `arrange` is called for a study whose falls are apart. It puts
/// falls into groups that a worker solves side by side. A group begins with one point of each fall,
/// so that the first batch contains all falls; its other points follow, fall by fall. Needs 20
/// bytes for each run of adjacent points with the same model.
class PointOrder {
 public:
  /// A study with more models keeps the order of its numbers, because finding their falls takes
  /// about a microsecond a model.
  static constexpr std::uint64_t kMaxModels = 1'000'000;

  /// Orders the points from `first` on if their falls are apart. `first` is 0 or the end of the
  /// ordered points. `open` contains the points that may be leased. A group has `falls_a_group`
  /// falls with open points, the last one fewer.
  void arrange(const protocol::PointTable& table, std::uint64_t first, const IntervalSet& open,
               std::uint64_t falls_a_group);
  bool is_arranged() const { return end_ > 0; }

  std::uint64_t place(std::uint64_t point) const;
  std::uint64_t point(std::uint64_t place) const;
  /// The points at these places, in order of the places, with neighbours merged.
  std::vector<Interval> points(const Interval& places) const;
  /// The places of these points.
  IntervalSet places(const IntervalSet& points) const;
  /// The places of the group around `place`; without groups, of the points with the same model.
  Interval group_at(const protocol::PointTable& table, std::uint64_t place) const;

 private:
  /// Consecutive points at consecutive places, up to the place of the next run.
  struct Run {
    std::uint64_t place;
    std::uint64_t point;
  };
  void append(const Interval& points);
  std::uint64_t end_of_run(std::size_t run) const;
  std::size_t run_of_place(std::uint64_t place) const;

  std::vector<Run> runs_;                ///< by place
  std::vector<std::uint32_t> by_point_;  ///< indices of runs in the order of points
  std::vector<std::uint64_t> groups_;    ///< first place of each group
  std::uint64_t end_ = 0;                ///< places from here on equal point numbers
};

}  // namespace oblique::server
