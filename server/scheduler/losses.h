#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace oblique::server {

using StudyId = std::uint64_t;
using WorkerId = std::uint64_t;
/// Number of a worker process, for as long as the scheduler runs.
using ProcessNumber = std::uint64_t;

/// Stands for no process: the loss cannot be taken back.
constexpr ProcessNumber kNoProcess = 0;

/// A lease that ended without an answer to its points.
struct Loss {
  ProcessNumber process;  ///< that was lost; kNoProcess if it ended the lease and lives on
  /// The process had solved points before, and held this one point and nothing else.
  bool alone;

  bool operator==(const Loss&) const = default;
};

/// How suspect points are after losses. A later one includes the earlier ones.
enum class Suspicion : std::uint8_t {
  kSound,    ///< handed out with others, in batches of any size
  kSuspect,  ///< in several losses: to a worker that holds nothing else
  kRisky,    ///< a single point that cost a worker which held nothing else
  kFailing   ///< cost so many of those that it fails, unless one of them comes back
};

struct LossLimits {
  std::uint32_t suspect_after = 2;  ///< losses of distinct processes
  std::uint32_t failing_after = 3;  ///< losses of processes that held nothing else
};

/// The losses that a range of points was in, each process once.
class LossHistory {
 public:
  /// Losses of kNoProcess are counted each time.
  void add(const Loss& loss) {
    constexpr std::size_t kMaxNoted = 16;  // further losses change nothing unless alone
    const auto known = std::ranges::find(losses_, loss.process, &Loss::process);
    if (loss.process != kNoProcess && known != losses_.end()) {
      known->alone = known->alone || loss.alone;
    } else if (loss.alone || losses_.size() < kMaxNoted) {
      losses_.push_back(loss);
    }
  }
  /// The process came back, so these points did not kill it. Returns whether it was in the history.
  bool take_back(ProcessNumber process) {
    return process != kNoProcess &&
           std::erase_if(losses_, [&](const Loss& loss) { return loss.process == process; }) > 0;
  }

  bool empty() const { return losses_.empty(); }
  std::uint32_t alone() const {
    return static_cast<std::uint32_t>(std::ranges::count(losses_, true, &Loss::alone));
  }
  Suspicion suspicion(const LossLimits& limits) const {
    if (alone() > 0) {
      return alone() >= limits.failing_after ? Suspicion::kFailing : Suspicion::kRisky;
    }
    return losses_.size() >= limits.suspect_after ? Suspicion::kSuspect : Suspicion::kSound;
  }

  bool operator==(const LossHistory&) const = default;

 private:
  std::vector<Loss> losses_;
};

/// What is known of one worker process. Each of its connections is a worker of its own.
struct WorkerProcess {
  std::string id{};              ///< as it says itself; empty when it says none
  std::set<WorkerId> workers{};  ///< that are connected
  /// Since when it has solved points that were handed to it; nothing: not yet.
  std::optional<std::int64_t> proven_since_ms{};
  std::uint32_t lost_in_a_row = 0;   ///< losses since it last solved something
  std::uint64_t losses = 0;          ///< leases of it that ended without an answer
  std::set<StudyId> in_histories{};  ///< studies with points whose history it may be in
};

/// The processes behind the workers, including processes that are gone and may come back.
class WorkerProcesses {
 public:
  /// Of the processes that are gone the latest `most_absent` are remembered.
  explicit WorkerProcesses(std::size_t most_absent) : most_absent_(most_absent) {}

  /// A connection of the process `id`; an empty one is a process of its own. Returns its number.
  ProcessNumber join(const std::string& id, WorkerId worker);
  /// The connection ended. The process may be forgotten.
  void leave(ProcessNumber number, WorkerId worker);

  /// No points of that study are in any history any more.
  void forget_study(StudyId study);

  /// Throws std::out_of_range for one that is not remembered.
  WorkerProcess& at(ProcessNumber number) { return processes_.at(number); }
  const WorkerProcess& at(ProcessNumber number) const { return processes_.at(number); }
  std::size_t size() const { return processes_.size(); }

  /// Throws std::logic_error unless exactly the processes that should be are remembered, with
  /// `workers` connections in all.
  void check_invariants(std::size_t workers) const;

 private:
  void forget(ProcessNumber number);

  std::size_t most_absent_;
  ProcessNumber last_number_ = kNoProcess;
  std::map<ProcessNumber, WorkerProcess> processes_;
  std::map<std::string, ProcessNumber> numbers_;  // by id
  std::deque<ProcessNumber> absent_;              // the one that left first in front
};

}  // namespace oblique::server
