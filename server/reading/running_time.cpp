#include "server/reading/running_time.h"

namespace oblique::server {
namespace {

/// Instructions of SQLite's machine between two looks at the clock.
constexpr int kInstructionsPerLook = 10'000;

}  // namespace

RunningTime::RunningTime(sqlite3* database, const std::atomic<bool>& interrupted,
                         std::int64_t limit_ms)
    : database_(database), interrupted_(interrupted), limit_ms_(limit_ms) {
  sqlite3_progress_handler(
      database_, kInstructionsPerLook,
      [](void* self) { return static_cast<const RunningTime*>(self)->is_over() ? 1 : 0; }, this);
}

std::int64_t RunningTime::elapsed_ms() const {
  return std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - start_).count();
}

bool RunningTime::is_over() const {
  return interrupted_ || (limit_ms_ > 0 && elapsed_ms() > limit_ms_);
}

}  // namespace oblique::server
