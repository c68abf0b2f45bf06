#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

#include <sqlite3.h>

namespace oblique::server {

/// Ends what `database` runs when it takes longer than `limit_ms` (0: no limit) from here on, or
/// when `interrupted` is set, for as long as this is there: SQLite gives SQLITE_INTERRUPT then.
class RunningTime {
 public:
  RunningTime(sqlite3* database, const std::atomic<bool>& interrupted, std::int64_t limit_ms);
  ~RunningTime() { sqlite3_progress_handler(database_, 0, nullptr, nullptr); }
  RunningTime(const RunningTime&) = delete;
  RunningTime& operator=(const RunningTime&) = delete;

  /// Since it began.
  std::int64_t elapsed_ms() const;

 private:
  using Clock = std::chrono::steady_clock;

  bool is_over() const;

  sqlite3* database_;
  const std::atomic<bool>& interrupted_;
  std::int64_t limit_ms_;
  Clock::time_point start_ = Clock::now();
};

}  // namespace oblique::server
