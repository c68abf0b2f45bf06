#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "proto/oblique.pb.h"

namespace oblique::client {

/// Finds what a person who watches a study should be told beside its progress: what it waits for,
/// that it goes on, and that nothing was solved for long. Each once. The clock is the caller's.
class WatchTeller {
 public:
  using Seconds = std::chrono::duration<double>;

  /// A reason to wait is worth a word once it has lasted for so long: workers come and go.
  static constexpr Seconds kShortestWait{2};
  /// So long without a point solved, and with no reason known, is told.
  static constexpr Seconds kLongWithout{10};

  /// Takes in where the study is, so long after the watching began; `elapsed` must not fall. The
  /// sentence that is due now, or an empty text.
  std::string update(const protocol::StudyStatus& status, Seconds elapsed);

 private:
  std::string wait_to_tell(const protocol::StudyStatus& status, Seconds elapsed);

  std::string reason_;  ///< what the study waits for; empty: for nothing
  Seconds reason_since_{0};
  std::string said_reason_;  ///< of these, the one that was said
  std::uint64_t settled_ = 0;
  Seconds settled_since_{0};
  bool said_without_ = false;
};

}  // namespace oblique::client
