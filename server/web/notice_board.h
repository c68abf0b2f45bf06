#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>

#include "server/web/snapshot.h"

namespace oblique::server {

/// Where the loop leaves what others show. The loop makes a snapshot only when one is wanted, and
/// not before half a second after the last; it never waits here. Times are of the steady clock.
class NoticeBoard {
 public:
  using Shared = std::shared_ptr<const Snapshot>;

  explicit NoticeBoard(std::int64_t now_ms) : turned_ms_(now_ms) {}

  // ---- Of the loop.
  void turned(std::int64_t now_ms) { turned_ms_ = now_ms; }
  bool is_due(std::int64_t now_ms) const { return is_wanted_ && now_ms - put_ms_ >= kPause_ms; }
  /// Whether the next one is to have what the page shows.
  bool is_for_page() const { return is_page_open_; }
  /// False when somebody looks just now: try again in the next turn.
  bool put(Snapshot snapshot) {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock.owns_lock()) {
      return false;
    }
    put_ms_ = snapshot.made_ms;
    latest_ = std::make_shared<const Snapshot>(std::move(snapshot));
    is_wanted_ = false;
    is_page_open_ = false;
    return true;
  }

  // ---- Of any thread.
  std::int64_t turned_ms() const { return turned_ms_; }
  void want() { is_wanted_ = true; }
  void want_for_page() {
    is_page_open_ = true;
    is_wanted_ = true;
  }
  /// Null: there was none yet.
  Shared latest() const {
    const std::lock_guard lock(mutex_);
    return latest_;
  }
  /// A snapshot so old is as good as a new one.
  static constexpr std::int64_t kPause_ms = 500;

 private:
  std::atomic<std::int64_t> turned_ms_;
  std::atomic<bool> is_wanted_ = false;
  std::atomic<bool> is_page_open_ = false;
  std::int64_t put_ms_ = INT64_MIN / 2;  // of the loop
  mutable std::mutex mutex_;
  Shared latest_;  // guarded by mutex_
};

}  // namespace oblique::server
