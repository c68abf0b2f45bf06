// The part of StudyPoints that takes points out, for a lease.
#include <algorithm>
#include <iterator>
#include <utility>

#include "server/scheduler/points/study_points.h"

namespace oblique::server {

std::optional<Batch> StudyPoints::take(const Portion& wanted, std::uint64_t& looks) {
  arrange(wanted.falls);
  if (has(Standing::kSound)) {
    return take(Standing::kSound, wanted, looks);
  }
  const auto free = next_left_in(wanted.follows, looks);
  if (!free) {
    return std::nullopt;
  }
  const std::uint64_t leased_before = leased_.size();
  std::uint64_t end = lease_fresh(*free, wanted, looks);
  const auto taken = [&] { return leased_.size() - leased_before; };
  const std::uint64_t enough =
      std::max(wanted.points, std::min(wanted.groups > 1 ? wanted.groups : 0, wanted.most_points));
  std::uint64_t run_end = free->end;
  while (const auto next = fresh_near(end, run_end, enough, taken(), looks)) {
    end = lease_fresh(*next, {enough - taken()}, looks);
    run_end = next->end;
  }
  begun_until_ = std::max(begun_until_, order_.group_at(*table_.get(), end - 1).end);
  return Batch{free->begin, end - free->begin, 0, {}, taken()};
}

/// The next fresh points, from one that is left in, for a batch that ends at `end`, has `taken`
/// points and wants `enough`: those behind a few settled ones, as where a finer grid has taken over
/// a coarser one. Not what is left of the run up to `run_end`, where the batch was cut, and not
/// those of a group of which there is no room for all points.
std::optional<Interval> StudyPoints::fresh_near(std::uint64_t end, std::uint64_t run_end,
                                                std::uint64_t enough, std::uint64_t taken,
                                                std::uint64_t& looks) {
  constexpr std::uint64_t kNear = 64;
  while (const auto next = taken < enough ? fresh_.first_from(end) : std::nullopt) {
    if (next->begin < run_end || next->begin - end > kNear) {
      return std::nullopt;
    }
    // Others may have the points between, or get them.
    const auto between = settled_.within(end, next->begin);
    const Interval group = order_.group_at(*table_.get(), next->begin);
    if (between.size() != 1 || !(between.front() == Interval{end, next->begin}) ||
        (group.begin >= end && group.end - group.begin > enough - taken)) {
      return std::nullopt;
    }
    if (!table_->has_filter()) {
      return next;
    }
    const std::uint64_t last = next->begin + std::min(looks, next->end - next->begin);
    const std::uint64_t found = order_.first_left_in(*table_.get(), next->begin, last);
    leave_out({next->begin, found});
    looks -= found - next->begin;
    if (found < last || looks == 0) {
      return found < last ? std::optional(Interval{found, next->end}) : std::nullopt;
    }
  }
  return std::nullopt;
}

bool StudyPoints::search(std::uint64_t& looks) {
  return has(Standing::kSound) || next_left_in(std::nullopt, looks).has_value();
}

/// Leases fresh points from the beginning of `free` on, which is left in. Returns where they end.
std::uint64_t StudyPoints::lease_fresh(const Interval& free, const Portion& wanted,
                                       std::uint64_t& looks) {
  const protocol::PointTable& table = *table_.get();
  const std::uint64_t cut = end_of_batch(table, order_, free, wanted);
  if (!table.has_filter()) {
    fresh_.erase(free.begin, cut);
    leased_.insert(free.begin, cut);
    return cut;
  }
  // As many points as the cut has numbers. Where it has half of them that is enough, for it may end
  // with a group.
  const std::uint64_t enough = cut - free.begin;
  const std::uint64_t last = free.begin + std::min(looks, free.end - free.begin);
  std::uint64_t taken = 0;
  std::uint64_t end = free.begin;
  std::uint64_t at = free.begin;
  while (at < last && taken < enough && !(at == cut && 2 * taken >= enough)) {
    const std::uint64_t next = std::min(at < cut ? cut : free.end, last);
    const std::uint64_t found = order_.first_left_in(table, at, next);
    leave_out({at, found});
    at = found;
    if (found < next) {
      fresh_.erase(found);
      leased_.insert(found);
      ++taken;
      end = ++at;
    }
  }
  looks -= at - free.begin;
  if (taken == 0) {  // no look was left for the first one, of which it is known
    fresh_.erase(free.begin);
    leased_.insert(free.begin);
    end = free.begin + 1;
  }
  return end;
}

/// The next fresh points, from one that is left in.
std::optional<Interval> StudyPoints::next_left_in(std::optional<std::uint64_t> follows,
                                                  std::uint64_t& looks) {
  while (auto free = next_fresh(follows)) {
    if (!table_->has_filter()) {
      return free;
    }
    const std::uint64_t last = free->begin + std::min(looks, free->end - free->begin);
    const std::uint64_t found = order_.first_left_in(*table_.get(), free->begin, last);
    leave_out({free->begin, found});
    looks -= found - free->begin;
    if (found < last) {
      return Interval{found, free->end};
    }
    if (looks == 0) {
      return std::nullopt;
    }
  }
  forget_excess();
  return std::nullopt;
}

/// Points that were found to be left out.
void StudyPoints::leave_out(const Interval& range) {
  fresh_.erase(range.begin, range.end);
  settled_.insert(range.begin, range.end);
  left_out_ += range.end - range.begin;
}

/// All were looked at: when there are fewer points than was counted, the count was wrong, and
/// nobody must wait for them.
void StudyPoints::forget_excess() {
  points_ = settled() + committing_.size() + leased_.size() + returned_points_;
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

std::optional<Batch> StudyPoints::take(Standing standing, const Portion& wanted,
                                       std::uint64_t& looks) {
  Returned& intervals = returned(standing);
  if (intervals.empty()) {
    return std::nullopt;
  }
  const auto [first, history] = *intervals.begin();
  std::uint64_t end = end_of_batch(*table_.get(), order_, {first, history.end}, wanted);
  intervals.erase(intervals.begin());
  if (end < history.end) {
    intervals.emplace(end, history);
  }
  leased_.insert(first, end);
  std::uint64_t points = end - first;
  // Between points that came back together there may be some that are left out.
  const bool may_join = table_->has_filter() && end == history.end;
  while (may_join && points < wanted.points && end < history.part_end && !intervals.empty()) {
    const auto next = intervals.begin();
    const std::uint64_t gap = next->first - end;
    if (next->second.part_end != history.part_end || next->second.attempts != history.attempts ||
        !(next->second.losses == history.losses) || gap > looks ||
        next->second.end - next->first > wanted.points - points ||
        order_.first_left_in(*table_.get(), end, next->first) != next->first) {
      break;
    }
    looks -= gap;
    leased_.insert(next->first, next->second.end);
    points += next->second.end - next->first;
    end = next->second.end;
    intervals.erase(next);
  }
  returned_points_ -= points;
  return Batch{first, end - first, history.attempts, history.losses, points};
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
