#pragma once

#include <cstdint>
#include <vector>

#include "proto/recipe/point_table.h"
#include "server/study/interval_set.h"

namespace oblique::server {

/// The order in which the points of a study are handed out. A *place* is a position in it, from 0.
///
/// Places are point numbers, unless points that share a fall lie apart and `arrange` was called.
/// Then falls are put into groups that a worker solves side by side. Of a group come first one
/// point of each fall, so that the first batch has all falls, and then the other points, fall by
/// fall. Costs 20 bytes a run of points that share a model and lie together.
class PointOrder {
 public:
  /// A study with more models stays in the order of its numbers: finding their falls takes about
  /// a microsecond a model.
  static constexpr std::uint64_t kMaxModels = 1'000'000;

  /// Brings the points from `first` on, which is 0 or where the arranged ones end, into order if
  /// falls lie apart. `open` are points that may be handed out: a group has `falls_a_group` falls
  /// that have some, the last one fewer.
  void arrange(const protocol::PointTable& table, std::uint64_t first, const IntervalSet& open,
               std::uint64_t falls_a_group);
  bool is_arranged() const { return end_ > 0; }

  std::uint64_t place(std::uint64_t point) const;
  std::uint64_t point(std::uint64_t place) const;
  /// The points of these places, in order of the places; neighbours are merged.
  std::vector<Interval> points(const Interval& places) const;
  /// The places of these points.
  IntervalSet places(const IntervalSet& points) const;
  /// The places around `place` of one group or, if they are not arranged, of one model.
  Interval group_at(const protocol::PointTable& table, std::uint64_t place) const;

 private:
  /// Points that follow each other and have places that do; up to the place of the next run.
  struct Run {
    std::uint64_t place;
    std::uint64_t point;
  };
  void append(const Interval& points);
  std::uint64_t end_of_run(std::size_t run) const;
  std::size_t run_of_place(std::uint64_t place) const;

  std::vector<Run> runs_;                ///< by place
  std::vector<std::uint32_t> by_point_;  ///< the runs in the order of their points
  std::vector<std::uint64_t> groups_;    ///< where the places of each group begin
  std::uint64_t end_ = 0;                ///< places from here on are point numbers
};

}  // namespace oblique::server
