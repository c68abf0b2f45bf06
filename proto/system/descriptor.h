#pragma once

#include <cerrno>
#include <system_error>
#include <utility>

#include <sys/eventfd.h>
#include <unistd.h>

namespace oblique::protocol {

/// Owns a file descriptor and closes it. The number -1 means that there is none.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() { close(); }
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    close();
    number_ = std::exchange(other.number_, -1);
    return *this;
  }

  int number() const { return number_; }
  bool is_open() const { return number_ >= 0; }
  /// Returns the descriptor and gives up its ownership.
  int release() { return std::exchange(number_, -1); }
  void close() {
    if (is_open()) {
      ::close(std::exchange(number_, -1));
    }
  }

 private:
  int number_ = -1;
};

/// Wakes another thread that polls a descriptor. Several calls before the poll count as one.
class WakeUp {
 public:
  /// Throws std::system_error if the system has no descriptor left.
  WakeUp() : descriptor_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    if (!descriptor_.is_open()) {
      throw std::system_error(errno, std::generic_category(), "eventfd");
    }
  }

  // Ignores errors: if the counter is already full or empty, the descriptor has the right state.
  void wake() const { static_cast<void>(eventfd_write(descriptor(), 1)); }
  void clear() const {
    eventfd_t count = 0;
    static_cast<void>(eventfd_read(descriptor(), &count));
  }
  /// The descriptor is readable from `wake` until `clear`.
  int descriptor() const { return descriptor_.number(); }

 private:
  Descriptor descriptor_;
};

}  // namespace oblique::protocol
