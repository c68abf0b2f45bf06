#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace oblique::server {

/// Number of a worker process, for as long as the scheduler runs.
using ProcessNumber = std::uint64_t;

/// In the place of a process: nobody who could come back.
constexpr ProcessNumber kNobody = 0;

/// A lease that ended without an answer to its points.
struct Loss {
  ProcessNumber process;  ///< that went with it; kNobody when it ended the lease and lives on
  /// The process had solved points before and held this one point and nothing else.
  bool alone;

  bool operator==(const Loss&) const = default;
};

/// What losses make of points. Of the later ones the earlier ones hold too.
enum class Standing : std::uint8_t {
  kSound,     ///< handed out with others, in batches of any size
  kSuspect,   ///< in several losses: to a worker that holds nothing else
  kAccused,   ///< a single point that cost a worker which held nothing else
  kCondemned  ///< cost so many of them that it fails, unless one of them comes back
};

/// How many losses make what of points.
struct LossLimits {
  std::uint32_t suspect_after = 2;    ///< losses, of distinct processes
  std::uint32_t condemned_after = 3;  ///< of these, of processes that held nothing else
};

/// The losses that a run of points was in, each process once. A process that comes back was not
/// killed by the points that it held: its loss is taken back.
class LossHistory {
 public:
  /// A process that is in it already is counted once; kNobody is counted each time.
  void add(const Loss& loss);
  /// Whether there was something to take back.
  bool take_back(ProcessNumber process);

  std::size_t count() const { return losses_.size(); }
  std::size_t alone() const;
  bool empty() const { return losses_.empty(); }
  Standing standing(const LossLimits& limits) const;

  bool operator==(const LossHistory&) const = default;

 private:
  std::vector<Loss> losses_;  // few: more than make points suspect are noted only when alone
};

}  // namespace oblique::server
