#pragma once

#include <atomic>
#include <cstdint>

namespace oblique::server {

/// How much may still be done, in numbers that are computed or looked up, and whether it is still
/// wanted.
class Work {
 public:
  /// `is_unwanted` must outlive this; from any thread.
  Work(std::uint64_t most, const std::atomic<bool>& is_unwanted)
      : left_(most), is_unwanted_(is_unwanted) {}

  /// False when that was too much, or nobody wants it any more.
  bool spend(std::uint64_t numbers) {
    left_ = numbers < left_ ? left_ - numbers : 0;
    return !is_over();
  }
  bool is_spent() const { return left_ == 0; }
  bool is_over() const { return is_spent() || is_unwanted_; }
  std::uint64_t left() const { return left_; }

 private:
  std::uint64_t left_;
  const std::atomic<bool>& is_unwanted_;
};

}  // namespace oblique::server
