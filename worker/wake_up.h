#pragma once

namespace oblique::worker {

/// Wakes a poll from another thread. Many calls before the poll are one.
class WakeUp {
 public:
  /// Throws std::system_error when the system gives no descriptor.
  WakeUp();
  ~WakeUp();
  WakeUp(const WakeUp&) = delete;
  WakeUp& operator=(const WakeUp&) = delete;

  void wake() const;
  void clear() const;
  /// Readable after `wake` and until `clear`.
  int descriptor() const { return descriptor_; }

 private:
  const int descriptor_;
};

}  // namespace oblique::worker
