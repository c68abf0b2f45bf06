#include "server/scheduler/points/study_points.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <utility>

namespace oblique::server {

StudyPoints::StudyPoints(StudyTable table, IntervalSet settled, std::uint64_t left_out,
                         const LossLimits& limits)
    : table_(std::move(table)), limits_(limits), settled_(std::move(settled)) {
  settled_.erase(size(), std::numeric_limits<std::uint64_t>::max());  // rows of other points
  left_out_ = std::min(left_out, settled_.size());  // a database that was edited may say more
  fresh_.insert(0, size());
  settled_.for_each(
      [this](const Interval& interval) { fresh_.erase(interval.begin, interval.end); });
}

void StudyPoints::arrange(std::uint64_t falls_a_group) {
  if (was_arranged_ || falls_a_group == 0) {
    return;
  }
  was_arranged_ = true;
  falls_a_group_ = falls_a_group;
  order_.arrange(*table_.get(), 0, fresh_, falls_a_group);
  if (order_.is_arranged()) {
    move_all([this](const IntervalSet& points) { return order_.places(points); });
    begun_until_ = 0;
  }
}

void StudyPoints::rest(bool has_leases) {
  table_.release();
  if (order_.is_arranged() && is_complete() && !has_leases) {
    move_all([this](const IntervalSet& places) {
      IntervalSet points;
      places.for_each([&](const Interval& interval) {
        for (const Interval& part : order_.points(interval)) {
          points.insert(part.begin, part.end);
        }
      });
      return points;
    });
    order_ = {};
    was_arranged_ = false;
    begun_until_ = 0;
  }
}

/// Replaces what is in each place by what `map` makes of it.
template <typename Map>
void StudyPoints::move_all(const Map& map) {
  for (IntervalSet* set : {&fresh_, &leased_, &committing_, &settled_}) {
    *set = map(*set);
  }
  for (Returned& intervals : returned_) {
    Returned moved;
    for (const auto& entry : intervals) {
      const History& history = entry.second;
      map(IntervalSet(entry.first, history.end)).for_each([&](const Interval& interval) {
        History part = history;
        part.end = interval.end;
        moved.emplace(interval.begin, part);
      });
    }
    intervals = std::move(moved);
  }
}

void StudyPoints::give_back(std::span<const Interval> parts, std::uint32_t attempts,
                            const LossHistory& losses, std::int64_t now_ms) {
  Returned& intervals = returned(losses.standing(limits_));
  for (const Interval& part : parts) {
    for (const Interval& interval : leased_.within(part.begin, part.end)) {
      intervals.emplace(interval.begin, History{interval.end, attempts, losses, now_ms});
      returned_points_ += interval.end - interval.begin;
    }
    leased_.erase(part.begin, part.end);
  }
}

void StudyPoints::take_back_losses(ProcessNumber process) {
  Returned cleared;
  for (Returned& intervals : returned_) {
    for (auto interval = intervals.begin(); interval != intervals.end();) {
      const auto next = std::next(interval);
      if (interval->second.losses.take_back(process)) {
        cleared.insert(intervals.extract(interval));
      }
      interval = next;
    }
  }
  for (auto& [first, history] : cleared) {
    returned(history.losses.standing(limits_)).emplace(first, history);
  }
}

bool StudyPoints::receive(std::uint64_t number) {
  const std::uint64_t point = order_.place(number);
  if (leased_.contains(point)) {
    leased_.erase(point);
  } else if (fresh_.contains(point)) {
    fresh_.erase(point);
  } else if (std::none_of(returned_.begin(), returned_.end(),
                          [&](Returned& intervals) { return erase_from(intervals, point); })) {
    return false;
  }
  committing_.insert(point);
  return true;
}

bool StudyPoints::erase_from(Returned& intervals, std::uint64_t point) {
  auto interval = intervals.upper_bound(point);
  if (interval == intervals.begin() || (--interval)->second.end <= point) {
    return false;
  }
  const History history = interval->second;
  if (interval->first == point) {
    intervals.erase(interval);
  } else {
    interval->second.end = point;
  }
  if (point + 1 < history.end) {
    intervals.emplace(point + 1, history);
  }
  --returned_points_;
  return true;
}

bool StudyPoints::settle(std::uint64_t number) {
  const std::uint64_t point = order_.place(number);
  if (!committing_.contains(point)) {
    return false;
  }
  committing_.erase(point);
  settled_.insert(point);
  return true;
}

IntervalSet StudyPoints::receive(const IntervalSet& left_out) {
  const IntervalSet places = extract(order_.places(left_out));
  committing_left_out_ += places.size();
  IntervalSet points;
  places.for_each([&](const Interval& interval) {
    committing_.insert(interval.begin, interval.end);
    for (const Interval& part : order_.points(interval)) {
      points.insert(part.begin, part.end);
    }
  });
  return points;
}

void StudyPoints::settle(const IntervalSet& left_out) {
  order_.places(left_out).for_each([&](const Interval& range) {
    for (const Interval& interval : committing_.within(range.begin, range.end)) {
      committing_.erase(interval.begin, interval.end);
      settled_.insert(interval.begin, interval.end);
      left_out_ += interval.end - interval.begin;
      committing_left_out_ -= interval.end - interval.begin;
    }
  });
}

bool StudyPoints::may_leave_out(const IntervalSet& points) const {
  const protocol::PointTable& table = *table_.get();
  bool all_filtered = points.empty() || points.back().end <= table.size();
  points.for_each([&](const Interval& range) {
    for (std::uint64_t point = range.begin; all_filtered && point < range.end;) {
      const std::size_t block = table.block_of_point(point);
      all_filtered = !table.recipe().blocks(static_cast<int>(block)).where().empty();
      point = table.block(block).first_point + table.block(block).points;
    }
  });
  return all_filtered;
}

void StudyPoints::grow(StudyTable table) {
  const std::uint64_t first = size();
  fresh_.insert(first, table.size());
  was_arranged_ = order_.is_arranged();
  if (was_arranged_) {
    order_.arrange(*table.get(), first, IntervalSet(first, table.size()), falls_a_group_);
  }
  table_ = std::move(table);
}

std::uint64_t StudyPoints::settle_unsolved(const IntervalSet& points) {
  const IntervalSet places = extract(order_.places(points));
  places.for_each(
      [this](const Interval& interval) { settled_.insert(interval.begin, interval.end); });
  return places.size();
}

/// Takes those of these places that are neither committing nor settled out of where they are.
IntervalSet StudyPoints::extract(const IntervalSet& places) {
  IntervalSet extracted;
  const auto add = [&](const std::vector<Interval>& intervals) {
    for (const Interval& interval : intervals) {
      extracted.insert(interval.begin, interval.end);
    }
  };
  places.for_each([&](const Interval& range) {
    for (IntervalSet* set : {&fresh_, &leased_}) {
      add(set->within(range.begin, range.end));
      set->erase(range.begin, range.end);
    }
    for (Returned& intervals : returned_) {
      add(extract_from(intervals, range));
    }
  });
  return extracted;
}

/// The parts of the intervals that lie in the range, which they lose.
std::vector<Interval> StudyPoints::extract_from(Returned& intervals, const Interval& range) {
  std::vector<Interval> parts;
  auto interval = intervals.upper_bound(range.begin);
  if (interval != intervals.begin()) {
    --interval;
  }
  while (interval != intervals.end() && interval->first < range.end) {
    const std::uint64_t first = interval->first;
    const History history = interval->second;
    if (history.end <= range.begin) {
      ++interval;
      continue;
    }
    interval = intervals.erase(interval);
    parts.push_back({std::max(first, range.begin), std::min(history.end, range.end)});
    returned_points_ -= parts.back().end - parts.back().begin;
    if (first < range.begin) {
      intervals.emplace(first, history).first->second.end = range.begin;
    }
    if (range.end < history.end) {
      intervals.emplace(range.end, history);
    }
  }
  return parts;
}

std::uint64_t StudyPoints::reopen(const IntervalSet& points) {
  std::uint64_t reopened = 0;
  order_.places(points).for_each([&](const Interval& asked) {
    for (const Interval& interval : settled_.within(asked.begin, asked.end)) {
      settled_.erase(interval.begin, interval.end);
      fresh_.insert(interval.begin, interval.end);
      reopened += interval.end - interval.begin;
    }
  });
  return reopened;
}

void StudyPoints::count_attempts(const PointAttempts& attempts) {
  // Workers may say any number; what is added to it must not overflow.
  constexpr std::uint32_t kMostAttempts = 1'000'000'000;
  attempts.for_each([this](const Interval& counted, std::uint32_t times) {
    order_.places(IntervalSet(counted.begin, counted.end)).for_each([&](const Interval& places) {
      for (const Interval& interval : fresh_.within(places.begin, places.end)) {
        fresh_.erase(interval.begin, interval.end);
        returned(Standing::kSound)
            .emplace(interval.begin,
                     History{interval.end, times < kMostAttempts ? times : kMostAttempts, {}, 0});
        returned_points_ += interval.end - interval.begin;
      }
    });
  });
}

std::vector<std::uint64_t> StudyPoints::condemned() const {
  std::vector<std::uint64_t> points;
  for (const auto& [first, history] : returned(Standing::kCondemned)) {
    points.push_back(order_.point(first));
  }
  return points;
}

void StudyPoints::check_invariants() const {
  IntervalSet all;
  std::uint64_t numbers = 0;
  std::uint64_t came_back = 0;
  const auto add = [&](const Interval& interval) {
    if (interval.begin >= interval.end) {
      throw std::logic_error("a study holds an empty interval of points");
    }
    all.insert(interval.begin, interval.end);
    numbers += interval.end - interval.begin;
  };
  for (const auto* set : {&fresh_, &leased_, &committing_, &settled_}) {
    set->for_each(add);
  }
  for (const Standing standing :
       {Standing::kSound, Standing::kSuspect, Standing::kAccused, Standing::kCondemned}) {
    for (const auto& [first, history] : returned(standing)) {
      add({first, history.end});
      came_back += history.end - first;
      if (history.losses.standing(limits_) != standing) {
        throw std::logic_error("returned points are in the place of another standing");
      }
    }
  }
  if (numbers != all.size() || !(all == IntervalSet(0, size()))) {
    throw std::logic_error("a point of a study is in no place or in two");
  }
  if (came_back != returned_points_) {
    throw std::logic_error("returned points are miscounted");
  }
  if (left_out_ > settled_.size()) {
    throw std::logic_error("a filter leaves out more points than are settled");
  }
}

}  // namespace oblique::server
