#include "server/scheduler/study_points.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <utility>

namespace oblique::server {
namespace {

/// Returns an end near `end`, at most `most`, for a batch from `first`. The end does not split the
/// group `cut`, unless the group is too large: if two workers share a group, both solve its falls.
std::uint64_t border_near(const Interval& cut, std::uint64_t first, std::uint64_t end,
                          std::uint64_t most) {
  if (cut.begin > first && 2 * (cut.begin - first) >= end - first) {
    return cut.begin;
  }
  if (cut.end <= most) {
    return cut.end;
  }
  return cut.begin > first ? cut.begin : end;
}

}  // namespace

StudyPoints::StudyPoints(StudyTable table, IntervalSet completed, std::uint64_t left_out)
    : table_(std::move(table)), completed_(std::move(completed)) {
  completed_.erase(size(), std::numeric_limits<std::uint64_t>::max());
  // A database that another program has edited may count more left-out than completed points.
  left_out_ = std::min(left_out, completed_.size());
  fresh_.insert(0, size());
  completed_.for_each(
      [this](const Interval& interval) { fresh_.erase(interval.begin, interval.end); });
}

void StudyPoints::arrange(std::uint64_t falls_a_group) {
  if (was_arranged_ || falls_a_group == 0) {
    return;
  }
  was_arranged_ = true;
  falls_a_group_ = falls_a_group;
  order_.arrange(*table_.get(), 0, fresh_, falls_a_group);
  if (!order_.is_arranged()) {
    return;
  }
  begun_until_ = 0;
  for (IntervalSet* set : {&fresh_, &leased_, &committing_, &completed_}) {
    *set = order_.places(*set);
  }
  for (Returned& intervals : returned_) {
    for (const auto& [first, returned] : std::exchange(intervals, {})) {
      const LeaseHistory& history = returned.history;  // Clang cannot capture structured bindings
      order_.places(IntervalSet(first, returned.end)).for_each([&](const Interval& interval) {
        intervals.emplace(interval.begin, ReturnedRange{interval.end, history});
      });
    }
  }
}

void StudyPoints::rest(bool has_leases) {
  table_.release();
  if (is_complete() && !has_leases) {  // without an order, places equal point numbers
    order_ = {};
    was_arranged_ = false;
    begun_until_ = 0;
  }
}

void StudyPoints::give_back(std::span<const Interval> parts, const LeaseHistory& history) {
  for (const Interval& part : parts) {
    for (const Interval& interval : leased_.within(part.begin, part.end)) {
      returned(history.is_suspect()).emplace(interval.begin, ReturnedRange{interval.end, history});
      returned_points_ += interval.end - interval.begin;
    }
    leased_.erase(part.begin, part.end);
  }
}

LeaseHistory* StudyPoints::suspect(std::uint64_t point) {
  const LeaseHistory* const known = returned_history(point);
  LeaseHistory history = known == nullptr ? LeaseHistory() : *known;
  history.has_crashed = true;
  const std::uint64_t place = order_.place(point);
  if (extract(IntervalSet(place, place + 1)).empty()) {
    return nullptr;
  }
  ++returned_points_;
  return &returned(true).emplace(place, ReturnedRange{place + 1, history}).first->second.history;
}

LeaseHistory* StudyPoints::returned_history(std::uint64_t point) {
  const std::uint64_t place = order_.place(point);
  for (Returned& intervals : returned_) {
    const auto next = intervals.upper_bound(place);
    if (next != intervals.begin() && std::prev(next)->second.end > place) {
      return &std::prev(next)->second.history;
    }
  }
  return nullptr;
}

bool StudyPoints::receive(std::uint64_t number) {
  const std::uint64_t point = order_.place(number);
  if (leased_.contains(point)) {
    leased_.erase(point);
  } else if (fresh_.contains(point)) {
    fresh_.erase(point);
  } else if (std::none_of(returned_.begin(), returned_.end(), [&](Returned& intervals) {
               return !extract_from(intervals, {point, point + 1}).empty();
             })) {
    return false;
  }
  committing_.insert(point);
  return true;
}

bool StudyPoints::complete(std::uint64_t number) {
  const std::uint64_t point = order_.place(number);
  if (!committing_.contains(point)) {
    return false;
  }
  committing_.erase(point);
  completed_.insert(point);
  return true;
}

IntervalSet StudyPoints::receive(const IntervalSet& left_out) {
  const IntervalSet places = extract(order_.places(left_out));
  committing_left_out_ += places.size();
  IntervalSet points;
  places.for_each([&](const Interval& interval) {
    committing_.insert(interval.begin, interval.end);
    points.insert(order_.points(interval));
  });
  return points;
}

void StudyPoints::complete(const IntervalSet& left_out) {
  order_.places(left_out).for_each([&](const Interval& range) {
    for (const Interval& interval : committing_.within(range.begin, range.end)) {
      committing_.erase(interval.begin, interval.end);
      completed_.insert(interval.begin, interval.end);
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

std::uint64_t StudyPoints::complete_reused(const IntervalSet& points) {
  const IntervalSet places = extract(order_.places(points));
  places.for_each(
      [this](const Interval& interval) { completed_.insert(interval.begin, interval.end); });
  return places.size();
}

/// Removes these places from the fresh, leased and returned points. Returns the removed places.
IntervalSet StudyPoints::extract(const IntervalSet& places) {
  IntervalSet extracted;
  places.for_each([&](const Interval& range) {
    for (IntervalSet* set : {&fresh_, &leased_}) {
      extracted.insert(set->within(range.begin, range.end));
      set->erase(range.begin, range.end);
    }
    for (Returned& intervals : returned_) {
      extracted.insert(extract_from(intervals, range));
    }
  });
  return extracted;
}

/// Removes the parts of `intervals` that lie in `range`, and returns them.
std::vector<Interval> StudyPoints::extract_from(Returned& intervals, const Interval& range) {
  std::vector<Interval> parts;
  auto interval = intervals.upper_bound(range.begin);
  if (interval != intervals.begin()) {
    --interval;
  }
  while (interval != intervals.end() && interval->first < range.end) {
    const std::uint64_t first = interval->first;
    const ReturnedRange whole = interval->second;
    if (whole.end <= range.begin) {
      ++interval;
      continue;
    }
    interval = intervals.erase(interval);
    parts.push_back({std::max(first, range.begin), std::min(whole.end, range.end)});
    returned_points_ -= parts.back().end - parts.back().begin;
    if (first < range.begin) {
      intervals.emplace(first, ReturnedRange{range.begin, whole.history});
    }
    if (range.end < whole.end) {
      intervals.emplace(range.end, whole);
    }
  }
  return parts;
}

std::uint64_t StudyPoints::reopen(const IntervalSet& points) {
  std::uint64_t reopened = 0;
  order_.places(points).for_each([&](const Interval& asked) {
    for (const Interval& interval : completed_.within(asked.begin, asked.end)) {
      completed_.erase(interval.begin, interval.end);
      fresh_.insert(interval.begin, interval.end);
      reopened += interval.end - interval.begin;
    }
  });
  return reopened;
}

std::uint64_t end_of_batch(const protocol::PointTable& table, const PointOrder& order,
                           const Interval& free, const BatchSize& wanted) {
  const Interval group = order.group_at(table, free.begin);
  const std::uint64_t points = std::max<std::uint64_t>(wanted.points, 1);
  const std::uint64_t room = free.end - free.begin;
  const std::uint64_t most = free.begin + std::min(std::max(points, wanted.most_points), room);
  std::uint64_t end = free.begin + std::min(points, room);
  // The batch gets up to `wanted.groups` whole groups if they end at `most` or earlier.
  std::uint64_t groups_end = group.end;
  for (std::uint64_t groups = 1; groups < wanted.groups && groups_end < most; ++groups) {
    const std::uint64_t next = order.group_at(table, groups_end).end;
    if (next > most) {
      break;
    }
    groups_end = next;
  }
  if (wanted.groups > 1 && groups_end <= most) {
    end = std::max(end, groups_end);
  }
  return end == free.end ? end : border_near(order.group_at(table, end), free.begin, end, most);
}

std::optional<Batch> StudyPoints::take(const BatchSize& wanted) {
  arrange(wanted.falls);
  if (!returned(false).empty()) {
    return take_returned(returned(false), wanted);
  }
  const auto free = next_fresh(wanted.follows);
  if (!free) {
    return std::nullopt;
  }
  const std::uint64_t leased_before = leased_.size();
  std::uint64_t end = lease_fresh(*free, wanted);
  const auto newly_leased = [&] { return leased_.size() - leased_before; };
  const std::uint64_t enough =
      std::max(wanted.points, std::min(wanted.groups > 1 ? wanted.groups : 0, wanted.most_points));
  std::uint64_t run_end = free->end;
  while (const auto next = fresh_near(end, run_end, enough, newly_leased())) {
    end = lease_fresh(*next, {enough - newly_leased()});
    run_end = next->end;
  }
  begun_until_ = std::max(begun_until_, order_.group_at(*table_.get(), end - 1).end);
  return Batch{free->begin, end - free->begin, {}, newly_leased()};
}

/// Returns the next fresh points if they can extend a batch that ends at `end` and has `leased` of
/// `enough` points. Only a few completed points may lie in between, as in a fine grid that has
/// reused results of a coarse grid. Returns nothing if the batch left fresh points before
/// `run_end`, or if the group of the next fresh points does not fit into the batch.
std::optional<Interval> StudyPoints::fresh_near(std::uint64_t end, std::uint64_t run_end,
                                                std::uint64_t enough, std::uint64_t leased) const {
  constexpr std::uint64_t kNear = 64;
  const auto next = leased < enough ? fresh_.first_from(end) : std::nullopt;
  if (!next || next->begin < run_end || next->begin - end > kNear) {
    return std::nullopt;
  }
  const auto between = completed_.within(end, next->begin);
  const Interval group = order_.group_at(*table_.get(), next->begin);
  if (between.size() != 1 || !(between.front() == Interval{end, next->begin}) ||
      (group.begin >= end && group.end - group.begin > enough - leased)) {
    return std::nullopt;
  }
  return next;
}

/// Leases fresh points from the start of `free`. Returns the place at which they end.
std::uint64_t StudyPoints::lease_fresh(const Interval& free, const BatchSize& wanted) {
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
  // The worker that began the last group continues with the first falls of the rest, so this worker
  // gets the last falls.
  const Interval last = fresh_.back();
  return Interval{last.begin + (last.end - last.begin) / 2, last.end};
}

/// Leases points from the start of the first interval.
Batch StudyPoints::take_returned(Returned& intervals, const BatchSize& wanted) {
  const auto [first, whole] = *intervals.begin();
  const std::uint64_t end = end_of_batch(*table_.get(), order_, {first, whole.end}, wanted);
  intervals.erase(intervals.begin());
  if (end < whole.end) {
    intervals.emplace(end, whole);
  }
  leased_.insert(first, end);
  returned_points_ -= end - first;
  return {first, end - first, whole.history};
}

void StudyPoints::check_invariants() const {
  IntervalSet all;
  std::uint64_t numbers = 0;
  std::uint64_t came_back = 0;
  const auto add = [&](const Interval& interval) {
    if (interval.begin >= interval.end) {
      throw std::logic_error("a study contains an empty interval of points");
    }
    all.insert(interval.begin, interval.end);
    numbers += interval.end - interval.begin;
  };
  for (const auto* set : {&fresh_, &leased_, &committing_, &completed_}) {
    set->for_each(add);
  }
  for (const bool is_suspect : {false, true}) {
    for (const auto& [first, whole] : returned(is_suspect)) {
      add({first, whole.end});
      came_back += whole.end - first;
      if (whole.history.is_suspect() != is_suspect) {
        throw std::logic_error("returned points are in the wrong set");
      }
    }
  }
  if (numbers != all.size() || !(all == IntervalSet(0, size()))) {
    throw std::logic_error("a point of a study is in no set or in two");
  }
  if (came_back != returned_points_) {
    throw std::logic_error("the number of returned points is wrong");
  }
  if (left_out_ > completed_.size()) {
    throw std::logic_error("a filter leaves out more points than are completed");
  }
}

}  // namespace oblique::server
