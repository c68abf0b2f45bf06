// The part of StudyPoints that takes points out, for a lease.
#include <algorithm>
#include <iterator>
#include <utility>

#include "server/scheduler/points/study_points.h"

namespace oblique::server {

std::optional<Batch> StudyPoints::take(const Portion& wanted) {
  arrange(wanted.falls);
  if (has(Standing::kSound)) {
    return take(Standing::kSound, wanted);
  }
  const auto free = next_fresh(wanted.follows);
  if (!free) {
    return std::nullopt;
  }
  const std::uint64_t leased_before = leased_.size();
  std::uint64_t end = lease_fresh(*free, wanted);
  const auto taken = [&] { return leased_.size() - leased_before; };
  const std::uint64_t enough =
      std::max(wanted.points, std::min(wanted.groups > 1 ? wanted.groups : 0, wanted.most_points));
  std::uint64_t run_end = free->end;
  while (const auto next = fresh_near(end, run_end, enough, taken())) {
    end = lease_fresh(*next, {enough - taken()});
    run_end = next->end;
  }
  begun_until_ = std::max(begun_until_, order_.group_at(*table_.get(), end - 1).end);
  return Batch{free->begin, end - free->begin, 0, {}, taken()};
}

/// The next fresh points for a batch that ends at `end`, has `taken` points and wants `enough`:
/// those behind a few settled ones, as where a finer grid has taken over a coarser one. Not what is
/// left of the run up to `run_end`, where the batch was cut, and not those of a group of which
/// there is no room for all points.
std::optional<Interval> StudyPoints::fresh_near(std::uint64_t end, std::uint64_t run_end,
                                                std::uint64_t enough, std::uint64_t taken) const {
  constexpr std::uint64_t kNear = 64;
  const auto next = taken < enough ? fresh_.first_from(end) : std::nullopt;
  if (!next || next->begin < run_end || next->begin - end > kNear) {
    return std::nullopt;
  }
  // Others may have the points between, or get them.
  const auto between = settled_.within(end, next->begin);
  const Interval group = order_.group_at(*table_.get(), next->begin);
  if (between.size() != 1 || !(between.front() == Interval{end, next->begin}) ||
      (group.begin >= end && group.end - group.begin > enough - taken)) {
    return std::nullopt;
  }
  return next;
}

/// Leases fresh points from the beginning of `free` on. Returns where they end.
std::uint64_t StudyPoints::lease_fresh(const Interval& free, const Portion& wanted) {
  const std::uint64_t end = end_of_batch(*table_.get(), order_, free, wanted);
  fresh_.erase(free.begin, end);
  leased_.insert(free.begin, end);
  return end;
}

std::optional<Interval> StudyPoints::next_fresh(std::optional<std::uint64_t> follows) const {
  if (fresh_.empty()) {
    return std::nullopt;
  }
  if (follows) {
    const auto rest = fresh_.first_from(*follows);
    if (rest && rest->begin < order_.group_at(*table_.get(), *follows - 1).end) {
      return rest;
    }
  }
  if (const auto begun_by_nobody = fresh_.first_from(begun_until_)) {
    return begun_by_nobody;
  }
  if (!order_.is_arranged()) {
    return fresh_.front();
  }
  // The worker that began the group goes on with its first falls, this one takes its last.
  const Interval last = fresh_.back();
  return Interval{last.begin + (last.end - last.begin) / 2, last.end};
}

std::optional<Batch> StudyPoints::take(Standing standing, const Portion& wanted) {
  Returned& intervals = returned(standing);
  if (intervals.empty()) {
    return std::nullopt;
  }
  const auto [first, history] = *intervals.begin();
  const std::uint64_t end = end_of_batch(*table_.get(), order_, {first, history.end}, wanted);
  intervals.erase(intervals.begin());
  if (end < history.end) {
    intervals.emplace(end, history);
  }
  leased_.insert(first, end);
  returned_points_ -= end - first;
  return Batch{first, end - first, history.attempts, history.losses};
}

std::optional<Batch> StudyPoints::take_condemned(std::uint64_t point, std::int64_t until_ms) {
  Returned& condemned = returned(Standing::kCondemned);
  const auto found = condemned.find(order_.place(point));
  if (found == condemned.end() || found->second.returned_ms > until_ms) {
    return std::nullopt;
  }
  const History history = found->second;
  condemned.erase(found);
  const std::uint64_t place = order_.place(point);
  leased_.insert(place);
  --returned_points_;
  return Batch{place, 1, history.attempts, history.losses, 1};
}

}  // namespace oblique::server
