#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "server/scheduler/loss_history.h"

namespace oblique::server {

using StudyId = std::uint64_t;
using WorkerId = std::uint64_t;

/// What is known of one worker process. Each of its connections is a worker of its own.
struct WorkerProcess {
  std::string id;              ///< as it says itself; empty when it says none
  std::set<WorkerId> workers;  ///< that are there
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
  std::size_t workers() const;  ///< of all processes

  /// Throws std::logic_error when more is remembered than should be, or processes are not to be
  /// found by their id.
  void check_invariants() const;

 private:
  void forget(ProcessNumber number);

  std::size_t most_absent_;
  ProcessNumber last_number_ = kNobody;
  std::map<ProcessNumber, WorkerProcess> processes_;
  std::map<std::string, ProcessNumber> numbers_;  // by id
  std::deque<ProcessNumber> absent_;              // the one that left first in front
};

}  // namespace oblique::server
