#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "server/scheduler/point_order.h"
#include "server/study/interval_set.h"
#include "server/study/study_table.h"

namespace oblique::server {

/// The size of a batch that a worker wants.
struct BatchSize {
  std::uint64_t points;      ///< target number of points; the batch ends at a nearby end of a group
  std::uint64_t groups = 1;  ///< minimum number of groups, if they fit into `most_points`
  /// maximum number of points if the batch is enlarged to complete groups; 0: same as `points`
  std::uint64_t most_points = 0;
  /// Number of falls that the worker solves side by side. If the study is arranged now, its groups
  /// get this size. Must be 0 while leases refer to places; the study is then not arranged.
  std::uint64_t falls = 0;
  /// The place at which the worker's last batch ended. The rest of that batch's last group comes
  /// first, because the worker has already solved the group's falls.
  std::optional<std::uint64_t> follows{};
};

/// Returns the place at which a batch from the start of `free` ends. The batch has at least one
/// point, and exactly one if `wanted` is one point.
std::uint64_t end_of_batch(const protocol::PointTable& table, const PointOrder& order,
                           const Interval& free, const BatchSize& wanted);

/// How the earlier leases of some points ended.
struct LeaseHistory {
  std::uint32_t attempts = 0;  ///< number of leases that ended
  std::uint32_t losses = 0;    ///< number of them that ended because the worker was lost
  bool has_crashed = false;    ///< a solver crashed on these points, perhaps because of others
  int signal = 0;  ///< signal of the first crash of a solver that held only this point; 0: none
  /// Number of workers in a row that were lost while they held only this point.
  std::uint32_t lost_alone = 0;
  std::int64_t lost_alone_since_ms = 0;  ///< time of the first of these losses

  /// Returns whether each of the points must be leased alone, to a worker that holds nothing else.
  bool is_suspect() const {
    constexpr std::uint32_t kMaxLosses = 5;
    return has_crashed || losses >= kMaxLosses;
  }
};

/// Points that are leased together: a run of places (PointOrder). Points in the run that were
/// completed before are not leased.
struct Batch {
  std::uint64_t first_place;
  std::uint64_t count;
  LeaseHistory history;
  std::uint64_t points = count;  ///< number of leased points at these places

  std::uint64_t end() const { return first_place + count; }
};

/// The state of each point of a study. Every point is in exactly one set:
/// - fresh: never leased by this run of the server
/// - returned: leased before; suspect points have a set of their own
/// - leased
/// - committing: its result is being written
/// - completed: it has a row, or a filter leaves it out
///
/// The cost depends on the number of intervals, not of points. Intervals, here and in Batch,
/// consist of places: the first lease orders the points so that those with the same fall follow
/// each other. Points that a filter leaves out are leased like all others; the worker reports them.
class StudyPoints {
 public:
  /// `completed` contains the completed points, among them `left_out` points that a filter leaves
  /// out. If the study is complete, its PointTable is not made.
  StudyPoints(StudyTable table, IntervalSet completed, std::uint64_t left_out);

  std::uint64_t size() const { return table_.size(); }
  /// Returns whether the points have several models. Makes the PointTable if necessary.
  bool has_models() const { return table_->models() > 1; }
  /// Releases the PointTable until the next lease. If the study is complete and without leases,
  /// also releases the order.
  void rest(bool has_leases);
  /// The current mapping between points and places.
  const PointOrder& order() const { return order_; }

  /// Leases returned sound points or, if there are none, fresh points. Fresh points come first from
  /// the rest of the group at `wanted.follows`, then from groups that no worker has begun, then
  /// from the second half of the last fresh points. Returns nothing if no point is left.
  std::optional<Batch> take(const BatchSize& wanted);
  /// Leases one suspect point. There must be one.
  Batch take_suspect() { return take_returned(returned(true), {1}); }

  /// Moves the leased points at the places `parts` to the returned points, with the given history.
  /// `parts` are in order. Points between the parts do not change.
  void give_back(std::span<const Interval> parts, const LeaseHistory& history);

  /// Makes an open point suspect, because a solver crashed on it. The point must not be leased.
  /// Returns its history; null for a point that is not open.
  LeaseHistory* suspect(std::uint64_t point);
  /// Returns the history that includes this point; null unless the point is returned.
  LeaseHistory* returned_history(std::uint64_t point);

  /// Moves a point to committing, because its result was received. Returns false if a result was
  /// received before or the point is not in the study.
  bool receive(std::uint64_t point);

  /// Moves left-out points to committing, because a worker has reported them. Returns the moved
  /// points.
  IntervalSet receive(const IntervalSet& left_out);

  /// Completes a point whose result is durable. Returns false if the point was not committing.
  bool complete(std::uint64_t point);
  /// Completes these left-out points, if they are committing.
  void complete(const IntervalSet& left_out);

  /// Appends fresh points to the study; `table` contains all points of the study.
  void grow(StudyTable table);

  /// Completes these points, which have a reused row, unless they are completed or committing.
  /// Returns the number of completed points.
  std::uint64_t complete_reused(const IntervalSet& points);

  /// Moves these points from completed to fresh. Returns the number of moved points.
  std::uint64_t reopen(const IntervalSet& points);

  bool has_free() const { return !returned(false).empty() || !fresh_.empty(); }
  bool has_suspect() const { return !returned(true).empty(); }
  bool has_filter() const { return table_->has_filter(); }
  /// Returns whether all of these points are in blocks with a filter.
  bool may_leave_out(const IntervalSet& points) const;
  bool is_complete() const { return completed() >= size(); }
  /// Returns whether any point has a result, durable or being written. Left-out points have none.
  bool has_results() const {
    return completed() + committing_.size() > left_out_ + committing_left_out_;
  }

  std::uint64_t free() const { return fresh_.size() + returned_points_; }
  std::uint64_t completed() const { return completed_.size(); }
  /// number of points that a filter leaves out; all of them are completed
  std::uint64_t left_out() const { return left_out_; }
  std::uint64_t leased() const { return leased_.size(); }
  /// The leased places.
  const IntervalSet& leased_set() const { return leased_; }

  /// Throws std::logic_error unless every point is in exactly one set.
  void check_invariants() const;

 private:
  struct ReturnedRange {
    std::uint64_t end;
    LeaseHistory history;
  };
  using Returned = std::map<std::uint64_t, ReturnedRange>;  // by first place

  Returned& returned(bool is_suspect) { return returned_.at(is_suspect ? 1 : 0); }
  const Returned& returned(bool is_suspect) const { return returned_.at(is_suspect ? 1 : 0); }
  Batch take_returned(Returned& intervals, const BatchSize& wanted);
  void arrange(std::uint64_t falls_a_group);
  std::optional<Interval> next_fresh(std::optional<std::uint64_t> follows) const;
  std::uint64_t lease_fresh(const Interval& free, const BatchSize& wanted);
  std::optional<Interval> fresh_near(std::uint64_t end, std::uint64_t run_end, std::uint64_t enough,
                                     std::uint64_t leased) const;
  std::vector<Interval> extract_from(Returned& intervals, const Interval& range);
  IntervalSet extract(const IntervalSet& places);

  StudyTable table_;
  PointOrder order_;
  IntervalSet fresh_;
  std::uint64_t begun_until_ = 0;  // end of the last group with points that were leased
  bool was_arranged_ = false;      // true if `arrange` was called, even if it changed nothing
  std::uint64_t falls_a_group_ = 1;
  std::array<Returned, 2> returned_;  // the points that are not suspect, and those that are
  IntervalSet leased_;
  IntervalSet committing_;
  IntervalSet completed_;
  std::uint64_t left_out_;  // number of completed points that a filter leaves out
  std::uint64_t committing_left_out_ = 0;
  std::uint64_t returned_points_ = 0;  // number of returned points, suspect or not
};

}  // namespace oblique::server
