#pragma once

#include <deque>
#include <mutex>
#include <utility>
#include <variant>

#include "proto/system/descriptor.h"
#include "server/query/query_pool.h"
#include "server/service/outbox/request_reader.h"
#include "server/store/writer.h"

namespace oblique::server {

/// Reports of the other threads, kept for the loop, which a descriptor wakes.
class ReportBox {
 public:
  using Item = std::variant<WriteReport, QueryReport, ReadReport>;

  /// From any thread.
  template <typename Reports>
  void put(Reports reports) {
    {
      const std::lock_guard lock(mutex_);
      for (auto& report : reports) {
        items_.emplace_back(std::move(report));
      }
    }
    woken_.wake();
  }

  /// From the loop: everything put so far.
  std::deque<Item> take() {
    woken_.clear();
    const std::lock_guard lock(mutex_);
    return std::exchange(items_, {});
  }

  /// Readable when there is something to take.
  int descriptor() const { return woken_.descriptor(); }

 private:
  protocol::WakeUp woken_;
  std::mutex mutex_;
  std::deque<Item> items_;  // guarded by mutex_
};

}  // namespace oblique::server
