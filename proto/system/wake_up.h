#pragma once

#include "proto/system/descriptor.h"

namespace oblique::protocol {

/// Wakes a poll from another thread. Many calls before the poll are one.
class WakeUp {
 public:
  /// Throws std::system_error when the system gives no descriptor.
  WakeUp();

  void wake() const;
  void clear() const;
  /// Readable after `wake` and until `clear`.
  int descriptor() const { return descriptor_.number(); }

 private:
  Descriptor descriptor_;
};

}  // namespace oblique::protocol
