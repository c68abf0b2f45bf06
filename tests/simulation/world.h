#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <random>
#include <stdexcept>
#include <utility>

namespace oblique::simulation {

/// What the simulated parties did must not happen.
class Violation : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// One clock, one source of chance and one list of what is to come. Everything follows from the
/// seed, so that a failing run can be had again.
class World {
 public:
  explicit World(std::uint64_t seed) : random_(seed) {}

  /// The clock that never runs backwards.
  std::int64_t now_ms() const { return now_ms_; }
  /// The clock that people set.
  std::int64_t utc_ms() const { return utc_at_zero_ms_ + now_ms_; }
  void set_clock(std::int64_t forward_ms) { utc_at_zero_ms_ += forward_ms; }

  void after(std::int64_t delay_ms, std::function<void()> what) {
    to_come_.emplace(std::pair{now_ms_ + delay_ms, next_++}, std::move(what));
  }

  /// Runs what is to come until `until_ms` or until `done` says so; `checks` runs after each event.
  void run(std::int64_t until_ms, const std::function<bool()>& done,
           const std::function<void()>& checks) {
    while (!to_come_.empty() && to_come_.begin()->first.first <= until_ms && !done()) {
      auto event = to_come_.extract(to_come_.begin());
      now_ms_ = event.key().first;
      event.mapped()();
      checks();
    }
  }

  bool chance(double probability) {
    return static_cast<double>(random_() >> 11U) * 0x1p-53 < probability;
  }
  /// A whole number from `low` to `high`, both included.
  std::int64_t between(std::int64_t low, std::int64_t high) {
    return low + static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(high - low + 1));
  }

  /// Whether faults happen still.
  bool faults = true;

 private:
  std::mt19937_64 random_;
  std::int64_t now_ms_ = 1'000'000;
  std::int64_t utc_at_zero_ms_ = 1'700'000'000'000;
  std::uint64_t next_ = 0;
  std::map<std::pair<std::int64_t, std::uint64_t>, std::function<void()>> to_come_;
};

}  // namespace oblique::simulation
