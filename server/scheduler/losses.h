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
/// Number of a worker process, unique while the scheduler runs.
using ProcessNumber = std::uint64_t;

/// Stands for no process. A loss of kNoProcess is never removed from a history.
constexpr ProcessNumber kNoProcess = 0;

/// A lease that ended before all its points were answered.
struct Loss {
  /// the lost process; kNoProcess if the worker ended the lease and is still connected
  ProcessNumber process;
  /// true if the process had solved points before and held only this point
  bool alone;

  bool operator==(const Loss&) const = default;
};

/// How suspect a point is after losses. Each level includes the conditions of the lower levels.
enum class Suspicion : std::uint8_t {
  kSound,    ///< may be in a batch of any size with other points
  kSuspect,  ///< had several losses; is leased to a worker that holds nothing else
  kRisky,    ///< a single point; a worker was lost while it held only this point
  kFailing   ///< several workers were lost holding only this point; it fails if none returns
};

struct LossLimits {
  std::uint32_t suspect_after = 2;  ///< number of losses of different processes
  std::uint32_t failing_after = 3;  ///< number of losses of processes that held only this point
};

/// The losses of a range of points. A process counts once.
class LossHistory {
 public:
  /// Adds a loss. A process counts once, but every loss of kNoProcess counts.
  void add(const Loss& loss) {
    // After this number of losses, only losses with `alone` are added.
    constexpr std::size_t kMaxNoted = 16;
    const auto known = std::ranges::find(losses_, loss.process, &Loss::process);
    if (loss.process != kNoProcess && known != losses_.end()) {
      known->alone = known->alone || loss.alone;
    } else if (loss.alone || losses_.size() < kMaxNoted) {
      losses_.push_back(loss);
    }
  }
  /// Removes the losses of a process that has returned, because the points did not kill it. Returns
  /// whether there were any.
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

/// A worker process. Each of its connections counts as one worker.
struct WorkerProcess {
  std::string id{};              ///< from WorkerHello; empty if the process sent none
  std::set<WorkerId> workers{};  ///< its connections
  /// time at which it first solved leased points; nothing if it has not yet
  std::optional<std::int64_t> proven_since_ms{};
  std::uint32_t lost_in_a_row = 0;   ///< number of losses since the process last solved a point
  std::uint64_t losses = 0;          ///< number of its leases that ended without an answer
  std::set<StudyId> in_histories{};  ///< studies whose loss histories contain this process
};

/// The processes of all workers, including absent processes that may return.
class WorkerProcesses {
 public:
  /// Keeps at most `most_absent` absent processes, the latest ones.
  explicit WorkerProcesses(std::size_t most_absent) : most_absent_(most_absent) {}

  /// Adds a connection of the process `id` and returns the process's number. An empty `id` is a new
  /// process.
  ProcessNumber join(const std::string& id, WorkerId worker);
  /// Removes a connection. A process without connections may be forgotten.
  void leave(ProcessNumber number, WorkerId worker);

  /// Removes a study from `in_histories` of all processes. To be called when the study's points
  /// have no loss histories any more.
  void forget_study(StudyId study);

  /// Throws std::out_of_range for a process that was forgotten.
  WorkerProcess& at(ProcessNumber number) { return processes_.at(number); }
  const WorkerProcess& at(ProcessNumber number) const { return processes_.at(number); }
  std::size_t size() const { return processes_.size(); }

  /// Throws std::logic_error if the index or the list of absent processes is wrong, or if the
  /// processes do not have `workers` connections in all.
  void check_invariants(std::size_t workers) const;

 private:
  void forget(ProcessNumber number);

  std::size_t most_absent_;
  ProcessNumber last_number_ = kNoProcess;
  std::map<ProcessNumber, WorkerProcess> processes_;
  std::map<std::string, ProcessNumber> numbers_;  // process numbers, by ID of the process
  std::deque<ProcessNumber> absent_;              // absent processes, the longest absent first
};

}  // namespace oblique::server
