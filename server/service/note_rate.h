#pragma once

#include <cstdint>

namespace oblique::server {

/// Keeps lines of one kind that peers can cause from flooding the log: so many are written in a
/// span of time, and of the rest only the number.
class NoteRate {
 public:
  /// Whether one more line may be written now.
  bool allows(std::int64_t now_ms) {
    roll(now_ms);
    if (written_ < kMostLines) {
      ++written_;
      return true;
    }
    ++left_out_;
    return false;
  }

  /// How many lines were left out in spans that are over, since this was asked.
  std::uint64_t take_left_out(std::int64_t now_ms) {
    roll(now_ms);
    const std::uint64_t told = left_out_before_;
    left_out_before_ = 0;
    return told;
  }

 private:
  static constexpr std::uint64_t kMostLines = 20;
  static constexpr std::int64_t kSpan_ms = 10'000;

  void roll(std::int64_t now_ms) {
    if (now_ms - began_ms_ >= kSpan_ms) {
      began_ms_ = now_ms;
      written_ = 0;
      left_out_before_ += left_out_;
      left_out_ = 0;
    }
  }

  std::int64_t began_ms_ = 0;
  std::uint64_t written_ = 0;
  std::uint64_t left_out_ = 0;
  std::uint64_t left_out_before_ = 0;
};

}  // namespace oblique::server
