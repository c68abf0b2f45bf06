#include "proto/system/wake_up.h"

#include <sys/eventfd.h>

#include <cerrno>
#include <system_error>

namespace oblique::protocol {

WakeUp::WakeUp() : descriptor_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (!descriptor_.is_open()) {
    throw std::system_error(errno, std::generic_category(), "eventfd");
  }
}

// A full or an empty counter is no error here: the descriptor is readable, or not, as it should be.

void WakeUp::wake() const {
  static_cast<void>(eventfd_write(descriptor(), 1));
}

void WakeUp::clear() const {
  eventfd_t count = 0;
  static_cast<void>(eventfd_read(descriptor(), &count));
}

}  // namespace oblique::protocol
