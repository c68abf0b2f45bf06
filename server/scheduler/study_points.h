#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "server/scheduler/losses.h"
#include "server/scheduler/point_order.h"
#include "server/study/interval_set.h"
#include "server/study/study_table.h"

namespace oblique::server {

/// How many points a worker wants under one lease.
struct BatchSize {
  std::uint64_t points;           ///< about as many: the batch ends with a group if one ends near
  std::uint64_t groups = 1;       ///< at least as many groups, if `most_points` has room for them
  std::uint64_t most_points = 0;  ///< limit for one whole group more, or for `groups`; 0: `points`
  /// Falls that the worker solves side by side: the size of groups if the study is arranged now. 0:
  /// it must not be, for leases are of places.
  std::uint64_t falls = 0;
  /// The place at which the worker's last batch ended. The rest of that batch's last group, whose
  /// falls the worker has solved, comes first.
  std::optional<std::uint64_t> follows{};
};

/// The place at which the batch that begins with the places `free` ends. A batch has one point at
/// least, and one at most when one is wanted.
std::uint64_t end_of_batch(const protocol::PointTable& table, const PointOrder& order,
                           const Interval& free, const BatchSize& wanted);

/// Points that are handed out together, under one lease: a run of places (PointOrder), without some
/// that were completed before.
struct Batch {
  std::uint64_t first_place;
  std::uint64_t count;
  std::uint32_t attempts;        ///< how often these points had been leased before
  LossHistory losses;            ///< of the leases before
  std::uint64_t points = count;  ///< the number of these places whose points are handed out

  std::uint64_t end() const { return first_place + count; }
};

/// Where the points of one study stand. Every point is in exactly one place: fresh (never leased by
/// this run of the server), returned with one of the four standings that its losses give it,
/// leased, committing (its result is on the way to the disk) or completed. The cost grows with the
/// number of intervals, not of points. Intervals, here and in Batch, are of places: the first lease
/// brings the points into an order in which those that share a fall follow each other.
///
/// Points that a filter leaves out are handed out as all others. The worker names them, and they
/// are completed without a row.
class StudyPoints {
 public:
  /// `completed` are the points that are completed already, `left_out` of them by a filter. Of a
  /// study that is complete the table is not made.
  StudyPoints(StudyTable table, IntervalSet completed, std::uint64_t left_out,
              const LossLimits& limits);

  std::uint64_t size() const { return table_.size(); }
  /// Whether they have several models; the table is made when there is none.
  bool has_models() const { return table_->models() > 1; }
  /// Nothing is handed out for a while: the table is forgotten until something is, and the order
  /// of a complete study of which there are no leases.
  void rest(bool has_leases);
  /// Points and places, as they are now.
  const PointOrder& order() const { return order_; }

  /// Takes points out of the returned sound ones or, when there are none, the fresh ones: those
  /// that are left of the group that `wanted` follows, then groups of which nothing was leased yet,
  /// then the second half of what is left of the last. Nothing when there are none.
  std::optional<Batch> take(const BatchSize& wanted);
  /// The same out of the returned ones of that standing.
  std::optional<Batch> take(Suspicion suspicion, const BatchSize& wanted);
  /// A point that fails, and why.
  struct Failure {
    std::uint64_t point;
    std::uint32_t attempts;
    std::uint32_t alone;  ///< losses of workers that held nothing else
  };
  /// The points that were condemned at `until_ms` or before. Their failures are committing now.
  std::vector<Failure> take_due_failures(std::int64_t until_ms);

  /// The points at the places `parts`, in order, that are still leased are returned at `now_ms`,
  /// with the history given. Those between the parts stay where they are.
  void give_back(std::span<const Interval> parts, std::uint32_t attempts, const LossHistory& losses,
                 std::int64_t now_ms);

  /// The losses of returned points that went with this process are taken back.
  void take_back_losses(ProcessNumber process);

  /// The result of a point came in: false when the point was received before or is not of this
  /// study, else it is now committing.
  bool receive(std::uint64_t point);

  /// The same of points that a filter leaves out. Returns those that are committing now.
  IntervalSet receive(const IntervalSet& left_out);

  /// The result of a committing point is durable. False when the point was not committing.
  bool complete(std::uint64_t point);
  /// It is durable that a filter leaves these points out, as far as they are committing.
  void complete(const IntervalSet& left_out);

  /// The study has got points behind those that it had, which are those of `table` too: they are
  /// fresh.
  void grow(StudyTable table);

  /// Those of these points that are not completed, nor on their way, have a row from elsewhere and
  /// are completed. Returns how many they were.
  std::uint64_t complete_reused(const IntervalSet& points);

  /// The completed ones among these points become fresh. Returns how many they were.
  std::uint64_t reopen(const IntervalSet& points);

  bool has_free() const { return has(Suspicion::kSound) || !fresh_.empty(); }
  bool has_filter() const { return table_->has_filter(); }
  /// Whether all of them are points of the study in blocks with a filter.
  bool may_leave_out(const IntervalSet& points) const;
  /// Returned points of that standing.
  bool has(Suspicion suspicion) const { return !returned(suspicion).empty(); }
  /// When the next points to be leased of that standing came back. There must be one.
  std::int64_t returned_ms(Suspicion suspicion) const {
    return returned(suspicion).begin()->second.returned_ms;
  }
  bool is_complete() const { return completed() >= size(); }
  /// Some point has a result, durable or on its way. That a filter leaves a point out is none.
  bool has_results() const {
    return completed() + committing_.size() > left_out_ + committing_left_out_;
  }

  std::uint64_t free() const { return fresh_.size() + returned_points_; }
  std::uint64_t completed() const { return completed_.size(); }
  std::uint64_t left_out() const { return left_out_; }  ///< among the completed ones
  std::uint64_t leased() const { return leased_.size(); }
  /// Places.
  const IntervalSet& leased_set() const { return leased_; }

  /// Throws std::logic_error unless every point is in exactly one place.
  void check_invariants() const;

 private:
  struct History {
    std::uint64_t end;
    std::uint32_t attempts;
    LossHistory losses;
    std::int64_t returned_ms;
  };
  using Returned = std::map<std::uint64_t, History>;  // by first point

  Returned& returned(Suspicion suspicion) {
    return returned_.at(static_cast<std::size_t>(suspicion));
  }
  const Returned& returned(Suspicion suspicion) const {
    return returned_.at(static_cast<std::size_t>(suspicion));
  }
  void arrange(std::uint64_t falls_a_group);
  std::optional<Interval> next_fresh(std::optional<std::uint64_t> follows) const;
  std::uint64_t lease_fresh(const Interval& free, const BatchSize& wanted);
  std::optional<Interval> fresh_near(std::uint64_t end, std::uint64_t run_end, std::uint64_t enough,
                                     std::uint64_t leased) const;
  std::vector<Interval> extract_from(Returned& intervals, const Interval& range);
  IntervalSet extract(const IntervalSet& places);

  StudyTable table_;
  PointOrder order_;
  LossLimits limits_;
  IntervalSet fresh_;
  std::uint64_t begun_until_ = 0;  // of all groups before, points were leased
  bool was_arranged_ = false;      // or stays as it is numbered
  std::uint64_t falls_a_group_ = 1;
  std::array<Returned, 4> returned_;  // by standing
  IntervalSet leased_;
  IntervalSet committing_;
  IntervalSet completed_;
  std::uint64_t left_out_;  // among the completed ones
  std::uint64_t committing_left_out_ = 0;
  std::uint64_t returned_points_ = 0;  // of any standing
};

}  // namespace oblique::server
