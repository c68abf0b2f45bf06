#pragma once

#include <sys/eventfd.h>

#include <cerrno>
#include <system_error>

#include "proto/system/descriptor.h"

namespace oblique::protocol {

/// Wakes a poll from another thread. Many calls before the poll count once.
class WakeUp {
 public:
  /// Throws std::system_error when the system gives no descriptor.
  WakeUp() : descriptor_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    if (!descriptor_.is_open()) {
      throw std::system_error(errno, std::generic_category(), "eventfd");
    }
  }

  // A full or an empty counter is no error: the descriptor is readable, or not, as it should be.
  void wake() const { static_cast<void>(eventfd_write(descriptor(), 1)); }
  void clear() const {
    eventfd_t count = 0;
    static_cast<void>(eventfd_read(descriptor(), &count));
  }
  /// Readable after `wake` and until `clear`.
  int descriptor() const { return descriptor_.number(); }

 private:
  Descriptor descriptor_;
};

}  // namespace oblique::protocol
