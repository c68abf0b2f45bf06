#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "server/scheduler/points/batch_cut.h"
#include "server/scheduler/points/interval_set.h"
#include "server/scheduler/points/loss_history.h"
#include "server/scheduler/points/point_attempts.h"
#include "server/scheduler/points/study_table.h"

namespace oblique::server {

/// On which terms a study gets workers: those of the highest priority come first, and among them
/// each gets batches in proportion to its weight.
struct StudyTerms {
  std::int32_t priority = 0;
  double weight = 1.0;
  /// Workers of any solver version take part, not only of the one that the study began with.
  bool mixes_versions = false;

  bool operator==(const StudyTerms&) const = default;
};

/// Points that are handed out together, under one lease: no gap, one model or several.
struct Batch {
  std::uint64_t first_point;
  std::uint64_t count;
  std::uint32_t attempts;  ///< how often these points had been leased before
  LossHistory losses;      ///< of the leases before

  std::uint64_t end() const { return first_point + count; }
};

/// Where the points of one study stand. Every point is in exactly one place: fresh (never leased by
/// this run of the server), returned with one of the four standings that its losses give it,
/// leased, committing (its result is on the way to the disk) or settled. The cost grows with the
/// number of intervals, not of points.
class StudyPoints {
 public:
  /// `settled` are the points that have a row already.
  StudyPoints(StudyTable table, IntervalSet settled, const LossLimits& limits);

  std::uint64_t size() const { return table_.size(); }
  /// How many models they have; the table is made when there is none.
  std::uint64_t models() const { return table_->models(); }
  /// Nothing is handed out for a while: the table is forgotten until something is.
  void rest() { table_.release(); }

  /// Takes points out of the returned sound ones or, when there are none, the fresh ones: those
  /// that are left of the model that `wanted` follows, then models of which nothing was taken yet,
  /// then what is left of any. Nothing when there are none.
  std::optional<Batch> take(const Portion& wanted);
  /// The same out of the returned ones of that standing.
  std::optional<Batch> take(Standing standing, const Portion& wanted);
  /// The condemned point if it came back at `until_ms` or before, else nothing.
  std::optional<Batch> take_condemned(std::uint64_t point, std::int64_t until_ms);

  /// The points of [begin, end) that are still leased are returned at `now_ms`, with the history
  /// given.
  void give_back(const Interval& range, std::uint32_t attempts, const LossHistory& losses,
                 std::int64_t now_ms);

  /// The losses of returned points that went with this process are taken back.
  void take_back_losses(ProcessNumber process);

  /// The result of a point came in: false when the point was received before or is not of this
  /// study, else it is now committing.
  bool receive(std::uint64_t point);

  /// The result of a committing point is durable. False when the point was not committing.
  bool settle(std::uint64_t point);

  /// The study has got points behind those that it had, which are those of `table` too: they are
  /// fresh.
  void grow(StudyTable table);

  /// Those of these points that are not settled, nor on their way, have a row from elsewhere and
  /// are settled. Returns how many they were.
  std::uint64_t settle_unsolved(const IntervalSet& points);

  /// The settled ones among these points become fresh. Returns how many they were.
  std::uint64_t reopen(const IntervalSet& points);

  /// The fresh ones among these points were leased so often before, by an earlier run of the server
  /// or before they were reopened.
  void count_attempts(const PointAttempts& attempts);

  bool has_free() const { return has(Standing::kSound) || !fresh_.empty(); }
  /// Returned points of that standing.
  bool has(Standing standing) const { return !returned(standing).empty(); }
  /// When the next points to be taken of that standing came back. There must be one.
  std::int64_t returned_ms(Standing standing) const {
    return returned(standing).begin()->second.returned_ms;
  }
  bool is_complete() const { return settled_.size() == table_.size(); }
  /// Some point has a result, durable or on its way.
  bool has_results() const { return !settled_.empty() || !committing_.empty(); }

  std::vector<std::uint64_t> condemned() const;  ///< points

  std::uint64_t free() const;  ///< fresh and returned points
  std::uint64_t settled() const { return settled_.size(); }
  std::uint64_t leased() const { return leased_.size(); }
  const IntervalSet& settled_set() const { return settled_; }
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

  Returned& returned(Standing standing) { return returned_.at(static_cast<std::size_t>(standing)); }
  const Returned& returned(Standing standing) const {
    return returned_.at(static_cast<std::size_t>(standing));
  }
  std::optional<Interval> next_fresh(std::optional<std::uint64_t> follows) const;
  static bool erase_from(Returned& intervals, std::uint64_t point);
  static std::vector<Interval> extract_from(Returned& intervals, const Interval& range);

  StudyTable table_;
  LossLimits limits_;
  IntervalSet fresh_;
  std::uint64_t begun_until_ = 0;     // of all models before, points were taken
  std::array<Returned, 4> returned_;  // by standing
  IntervalSet leased_;
  IntervalSet committing_;
  IntervalSet settled_;
};

}  // namespace oblique::server
