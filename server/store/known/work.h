#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <utility>

namespace oblique::server {

/// How much may still be done, in numbers that are computed or looked up, and whether it is still
/// wanted and at turn.
class Work {
 public:
  using IsTurnOver = std::function<bool()>;

  /// `is_unwanted` must outlive this; from any thread. `is_turn_over` is asked now and then whether
  /// others are at turn.
  Work(std::uint64_t most, const std::atomic<bool>& is_unwanted, IsTurnOver is_turn_over = {})
      : left_(most), is_unwanted_(is_unwanted), ask_(std::move(is_turn_over)) {}

  /// False when that was too much, nobody wants it any more, or others are at turn.
  bool spend(std::uint64_t numbers) {
    left_ = numbers < left_ ? left_ - numbers : 0;
    since_asked_ += numbers;
    if (since_asked_ >= kAsksEvery && ask_) {
      since_asked_ = 0;
      is_turn_over_ = is_turn_over_ || ask_();
    }
    return !is_over();
  }
  bool is_spent() const { return left_ == 0; }
  bool is_over() const { return is_spent() || is_turn_over_ || is_unwanted_; }

 private:
  static constexpr std::uint64_t kAsksEvery = 10'000;

  std::uint64_t left_;
  std::uint64_t since_asked_ = 0;
  bool is_turn_over_ = false;
  const std::atomic<bool>& is_unwanted_;
  IsTurnOver ask_;
};

}  // namespace oblique::server
