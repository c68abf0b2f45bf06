#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>

namespace oblique::worker {

inline constexpr std::int64_t kNever_ms = std::numeric_limits<std::int64_t>::max();

/// When a worker ends by itself.
struct LeavingSettings {
  std::int64_t until_ms = kNever_ms;      ///< the process has ended by then; same clock as `now_ms`
  std::string until = {};                 ///< the same as people said it
  std::int64_t idle_exit_ms = kNever_ms;  ///< so long without work
  std::int64_t farewell_ms = 3000;        ///< that leaving takes at most
};

/// Points of one study that a worker holds.
struct HeldPoints {
  std::uint64_t study_id;
  std::uint64_t points;
};

/// Knows how fast the worker is, from what it solved, and so what it can still end before it must
/// leave. What it knows nothing of yet it expects to end in time: the attempt says how long it
/// takes, and what is cut is given back.
class Leaving {
 public:
  Leaving(const LeavingSettings& settings, std::size_t threads);

  /// The worker has something to do, or had until now.
  void note_work(std::int64_t now_ms) { last_work_ms_ = now_ms; }
  /// A batch of that size came.
  void note_batch(const HeldPoints& batch) { last_batch_ = batch; }
  /// So many points of a study took `busy_s` of one thread.
  void note_solved(const HeldPoints& solved, double busy_s);

  /// How many of these, which are worked on in their order, end in time.
  std::size_t ending_in_time(std::span<const HeldPoints> held, std::int64_t now_ms) const;
  /// Whether one batch more like the last one would end in time behind these.
  bool has_time_for_more(std::span<const HeldPoints> held, std::int64_t now_ms) const;

  /// Time is over, or was without work for so long.
  bool is_due(std::int64_t now_ms) const { return now_ms >= settings_.until_ms - farewell_ms(); }
  bool is_idle_for_too_long(std::int64_t now_ms) const {
    return settings_.idle_exit_ms != kNever_ms && now_ms - last_work_ms_ >= settings_.idle_exit_ms;
  }
  /// When one of both may become true next.
  std::int64_t next_deadline_ms() const;

 private:
  std::int64_t farewell_ms() const {
    return settings_.until_ms == kNever_ms ? 0 : settings_.farewell_ms;
  }
  double takes_ms(const HeldPoints& held) const;

  const LeavingSettings settings_;
  const double threads_;
  std::int64_t last_work_ms_ = 0;
  std::optional<HeldPoints> last_batch_;
  std::map<std::uint64_t, double> s_per_point_;  // of one thread, by study
};

}  // namespace oblique::worker
