#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace oblique::server {

/// Number of a worker process, for as long as the scheduler runs.
using ProcessNumber = std::uint64_t;

/// Stands for no process: the loss cannot be taken back.
constexpr ProcessNumber kNobody = 0;

/// A lease that ended without an answer to its points.
struct Loss {
  ProcessNumber process;  ///< that was lost; kNobody if it ended the lease and lives on
  /// The process had solved points before, and held this one point and nothing else.
  bool alone;

  bool operator==(const Loss&) const = default;
};

/// How suspect points are after losses. A later one includes the earlier ones.
enum class Standing : std::uint8_t {
  kSound,     ///< handed out with others, in batches of any size
  kSuspect,   ///< in several losses: to a worker that holds nothing else
  kAccused,   ///< a single point that cost a worker which held nothing else
  kCondemned  ///< cost so many of those that it fails, unless one of them comes back
};

struct LossLimits {
  std::uint32_t suspect_after = 2;    ///< losses of distinct processes
  std::uint32_t condemned_after = 3;  ///< losses of processes that held nothing else
};

/// The losses that a range of points was in, each process once.
class LossHistory {
 public:
  /// Losses of kNobody are counted each time.
  void add(const Loss& loss) {
    constexpr std::size_t kMostNoted = 16;  // further losses change nothing unless alone
    const auto known = std::ranges::find(losses_, loss.process, &Loss::process);
    if (loss.process != kNobody && known != losses_.end()) {
      known->alone = known->alone || loss.alone;
    } else if (loss.alone || losses_.size() < kMostNoted) {
      losses_.push_back(loss);
    }
  }
  /// The process came back, so these points did not kill it. Returns whether it was in the history.
  bool take_back(ProcessNumber process) {
    return process != kNobody &&
           std::erase_if(losses_, [&](const Loss& loss) { return loss.process == process; }) > 0;
  }

  bool empty() const { return losses_.empty(); }
  std::uint32_t alone() const {
    return static_cast<std::uint32_t>(std::ranges::count(losses_, true, &Loss::alone));
  }
  Standing standing(const LossLimits& limits) const {
    if (alone() > 0) {
      return alone() >= limits.condemned_after ? Standing::kCondemned : Standing::kAccused;
    }
    return losses_.size() >= limits.suspect_after ? Standing::kSuspect : Standing::kSound;
  }

  bool operator==(const LossHistory&) const = default;

 private:
  std::vector<Loss> losses_;
};

}  // namespace oblique::server
