#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

namespace oblique::server {

/// Consecutive points, half-open: [begin, end).
struct Interval {
  std::uint64_t begin;
  std::uint64_t end;

  bool operator==(const Interval&) const = default;
};

/// Returns the number of points of disjoint intervals.
inline std::uint64_t size_of(const std::vector<Interval>& intervals) {
  std::uint64_t points = 0;
  for (const Interval& interval : intervals) {
    points += interval.end - interval.begin;
  }
  return points;
}

/// A set of points, stored as disjoint intervals that do not touch. Its cost depends on the number
/// of intervals, not of points.
class IntervalSet {
 public:
  IntervalSet() = default;
  /// Creates the set [begin, end), which is empty if begin == end.
  IntervalSet(std::uint64_t begin, std::uint64_t end) { insert(begin, end); }

  /// Adds [begin, end), which may overlap the set. Does nothing if begin >= end.
  void insert(std::uint64_t begin, std::uint64_t end);
  void insert(std::uint64_t point) { insert(point, point + 1); }
  void insert(const std::vector<Interval>& intervals) {
    for (const Interval& interval : intervals) {
      insert(interval.begin, interval.end);
    }
  }

  /// Removes [begin, end). The set need not contain all of it.
  void erase(std::uint64_t begin, std::uint64_t end);
  void erase(std::uint64_t point) { erase(point, point + 1); }

  bool contains(std::uint64_t point) const;
  bool empty() const { return ends_.empty(); }

  /// Number of points.
  std::uint64_t size() const { return size_; }

  /// Number of intervals.
  std::size_t intervals() const { return ends_.size(); }

  /// Returns the lowest interval. The set must not be empty.
  Interval front() const { return {ends_.begin()->first, ends_.begin()->second}; }

  /// Returns the highest interval. The set must not be empty.
  Interval back() const { return {ends_.rbegin()->first, ends_.rbegin()->second}; }

  /// Returns the first interval that ends after `point`, without its part before `point`, if any.
  std::optional<Interval> first_from(std::uint64_t point) const;

  /// Returns the parts of the set inside [begin, end), in order.
  std::vector<Interval> within(std::uint64_t begin, std::uint64_t end) const;

  /// Calls `visit` with every interval, in order.
  template <typename Visitor>
  void for_each(Visitor visit) const {
    for (const auto& [begin, end] : ends_) {
      visit(Interval{begin, end});
    }
  }

  bool operator==(const IntervalSet& other) const { return ends_ == other.ends_; }

 private:
  std::map<std::uint64_t, std::uint64_t> ends_;  // end by begin
  std::uint64_t size_ = 0;
};

}  // namespace oblique::server
