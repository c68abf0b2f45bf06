#pragma once

#include <cerrno>
#include <cstdint>
#include <deque>
#include <mutex>
#include <system_error>
#include <utility>
#include <variant>

#include <sys/eventfd.h>

#include "proto/descriptor.h"
#include "server/queries/query_pool.h"
#include "server/service/request_reader.h"
#include "server/store/writer.h"

namespace oblique::server {

/// Reports of the other threads, kept for the loop, which a descriptor wakes.
class ReportBox {
 public:
  using Item = std::variant<WriteReport, QueryReport, ReadReport>;

  ReportBox() : woken_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    if (!woken_.is_open()) {
      throw std::system_error(errno, std::generic_category(), "eventfd");
    }
  }

  /// From any thread.
  template <typename Reports>
  void put(Reports reports) {
    {
      const std::lock_guard lock(mutex_);
      for (auto& report : reports) {
        items_.emplace_back(std::move(report));
      }
    }
    static_cast<void>(eventfd_write(woken_.number(), 1));
  }

  /// From the loop: everything put so far.
  std::deque<Item> take() {
    eventfd_t count = 0;
    static_cast<void>(eventfd_read(woken_.number(), &count));
    const std::lock_guard lock(mutex_);
    return std::exchange(items_, {});
  }

  /// Readable when there is something to take.
  int descriptor() const { return woken_.number(); }

 private:
  protocol::Descriptor woken_;
  std::mutex mutex_;
  std::deque<Item> items_;  // guarded by mutex_
};

}  // namespace oblique::server
