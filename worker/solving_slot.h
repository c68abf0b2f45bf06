#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <iterator>

namespace oblique::worker {

/// The points that one thread is solving, in memory that the worker shares with its parent process.
/// The slot is readable after a crash at any time.
struct SolvingSlot {
  void begin(std::uint64_t point) { replace(0, point + 1); }
  void end(std::uint64_t point) {
    replace(point + 1, 0);
    ++solved;
  }
  /// Records the first point of a model whose fall is solved ahead.
  void begin_fall(std::uint64_t point) { replace(0, (point + 1) | kFall); }
  void end_falls() {
    std::ranges::replace_if(
        points, [](std::uint64_t point) { return point >= kFall; }, 0);
  }
  void replace(std::uint64_t value, std::uint64_t other) {
    if (auto* const found = std::find(std::begin(points), std::end(points), value);
        found != std::end(points)) {
      *found = other;
    }
  }

  static constexpr std::uint64_t kFall = std::uint64_t{1} << 63U;
  static constexpr std::size_t kMostFalls = 64;
  static constexpr std::size_t kMostPoints = 256;  ///< with estimated errors; else a few lanes

  std::atomic<std::uint64_t> study_id;
  std::atomic<std::uint64_t> solved;                            ///< number of points
  std::atomic<std::uint64_t> points[kMostPoints + kMostFalls];  ///< point + 1; 0: none
};

}  // namespace oblique::worker
