#pragma once

#include <bit>
#include <cstdint>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "server/service/outbox/outbox.h"

// What peers can cause without end must not become a flood of lines in the log.
namespace oblique::server {

/// Keeps lines of one kind that peers can cause rare: so many are written in a
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

/// Counts frames that no sound peer sends. A flood of them does not become a flood of lines.
class BadFrames {
 public:
  explicit BadFrames(ToLog& log) : log_(log) {}

  /// Of a peer that is given up, for a reason that is said elsewhere.
  void count() { ++count_; }
  /// Of `who` nothing else is said.
  void count(std::string_view who) {
    ++count_;
    if (std::has_single_bit(count_)) {
      log_.note(Severity::kWarning,
                fmt::format("{} sent a frame that is no message ({} of them so far)", who, count_));
    }
  }
  std::uint64_t total() const { return count_; }

 private:
  ToLog& log_;
  std::uint64_t count_ = 0;
};

}  // namespace oblique::server
