#include "worker/wake_up.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace oblique::worker {
namespace {

int opened_eventfd() {
  const int descriptor = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (descriptor < 0) {
    throw std::system_error(errno, std::generic_category(), "eventfd");
  }
  return descriptor;
}

}  // namespace

WakeUp::WakeUp() : descriptor_(opened_eventfd()) {}

WakeUp::~WakeUp() {
  close(descriptor_);
}

// A full or an empty counter is no error here: the descriptor is readable, or not, as it should be.

void WakeUp::wake() const {
  static_cast<void>(eventfd_write(descriptor_, 1));
}

void WakeUp::clear() const {
  eventfd_t count = 0;
  static_cast<void>(eventfd_read(descriptor_, &count));
}

}  // namespace oblique::worker
