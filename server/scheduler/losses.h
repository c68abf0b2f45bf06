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

/// No process: such a loss cannot be taken back.
constexpr ProcessNumber kNoProcess = 0;

/// A lease that ended without an answer to its points.
struct Loss {
  /// process that was lost; kNoProcess if the worker ended the lease and is still connected
  ProcessNumber process;
  /// The process had solved points before, and held only this point.
  bool alone;

  bool operator==(const Loss&) const = default;
};

/// Suspicion against points after losses. Each level includes the conditions of the lower ones.
enum class Suspicion : std::uint8_t {
  kSound,    ///< leased with others, in batches of any size
  kSuspect,  ///< part of several losses: leased to a worker that holds nothing else
  kRisky,    ///< a single point that a worker held alone when it was lost
  kFailing   ///< lost so many workers alone that it fails, unless one of them returns
};

struct LossLimits {
  std::uint32_t suspect_after = 2;  ///< losses of different processes
  std::uint32_t failing_after = 3;  ///< losses of processes that held only this point
};

/// The losses that a range of points was part of, each process once.
class LossHistory {
 public:
  /// Losses of kNoProcess count each time.
  void add(const Loss& loss) {
    constexpr std::size_t kMaxNoted = 16;  // more losses matter only if `alone`
    const auto known = std::ranges::find(losses_, loss.process, &Loss::process);
    if (loss.process != kNoProcess && known != losses_.end()) {
      known->alone = known->alone || loss.alone;
    } else if (loss.alone || losses_.size() < kMaxNoted) {
      losses_.push_back(loss);
    }
  }
  /// Removes the losses of a process that returned, so these points did not kill it. Returns
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

/// A worker process. Each of its connections is a worker of its own.
struct WorkerProcess {
  std::string id{};              ///< from WorkerHello; empty if it has none
  std::set<WorkerId> workers{};  ///< its connections
  /// When it first solved leased points; nothing: not yet.
  std::optional<std::int64_t> proven_since_ms{};
  std::uint32_t lost_in_a_row = 0;   ///< losses since it last solved something
  std::uint64_t losses = 0;          ///< its leases that ended without an answer
  std::set<StudyId> in_histories{};  ///< studies with points whose history may contain it
};

/// The processes of the workers, including absent ones that may return.
class WorkerProcesses {
 public:
  /// Keeps the latest `most_absent` absent processes.
  explicit WorkerProcesses(std::size_t most_absent) : most_absent_(most_absent) {}

  /// Adds a connection of the process `id` and returns the process's number. An empty `id` is a new
  /// process.
  ProcessNumber join(const std::string& id, WorkerId worker);
  /// Removes a connection. The process may be forgotten.
  void leave(ProcessNumber number, WorkerId worker);

  /// Removes a study whose points are in no history any more.
  void forget_study(StudyId study);

  /// Throws std::out_of_range for a process that was forgotten.
  WorkerProcess& at(ProcessNumber number) { return processes_.at(number); }
  const WorkerProcess& at(ProcessNumber number) const { return processes_.at(number); }
  std::size_t size() const { return processes_.size(); }

  /// Throws std::logic_error unless exactly the expected processes are kept, with `workers`
  /// connections in all.
  void check_invariants(std::size_t workers) const;

 private:
  void forget(ProcessNumber number);

  std::size_t most_absent_;
  ProcessNumber last_number_ = kNoProcess;
  std::map<ProcessNumber, WorkerProcess> processes_;
  std::map<std::string, ProcessNumber> numbers_;  // by id
  std::deque<ProcessNumber> absent_;              // the earliest first
};

}  // namespace oblique::server
