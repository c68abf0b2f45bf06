#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/scheduler/lease_index.h"
#include "server/scheduler/ready_queue.h"
#include "server/scheduler/scheduler_events.h"
#include "server/scheduler/study_points.h"
#include "server/scheduler/study_queue.h"
#include "server/scheduler/worker_processes.h"

namespace oblique::server {

/// A study as others see it.
struct StudyCounts {
  std::uint64_t points;
  std::uint64_t settled;  ///< also those that failed or are left out
  std::uint64_t failed;
  std::uint64_t left_out;  ///< by a filter, as far as workers have reported it
  std::uint64_t leased;
  bool cancelled;
  std::string solver_version;  ///< of its results; empty without results
  bool is_of_other_solver;     ///< points are open, and the server has another version

  std::uint64_t open() const { return points - settled; }
  std::uint64_t solved() const { return settled - std::min(settled, failed + left_out); }
};

/// Workers that hold points of a study, all of which have stored nothing for a time.
struct QuietWorkers {
  std::size_t workers;
  std::int64_t quiet_ms;  ///< of the one that stored something last
};

/// What a worker does; of several the first that is true.
enum class CrewState {
  kSilent,    ///< nothing came of it lately
  kSetAside,  ///< it gets nothing until it has solved a probe
  kWorking,   ///< it holds a batch
  kIdle,
};
inline constexpr std::size_t kCrewStates = 4;
constexpr const char* crew_name(CrewState state) {
  constexpr std::array kNames{"silent", "set_aside", "working", "idle"};
  return kNames.at(static_cast<std::size_t>(state));
}

/// Workers that do the same.
struct Crew {
  std::uint64_t workers = 0;
  std::uint64_t threads = 0;
};

struct WorkerCounts {
  std::uint64_t leased_points;
  std::uint64_t solved_points;
  std::int64_t silent_ms;
  std::uint64_t losses;  ///< leases of its process that ended without an answer
  bool is_proven;        ///< its process has solved points that were handed to it
  bool is_set_aside;     ///< it gets nothing until it has solved a probe
};

/// Decides who solves which points: (state, event, now) -> effects. No I/O, no clock, no thread, no
/// randomness; README.md has the table of states and events. Not thread-safe.
class Scheduler {
 public:
  explicit Scheduler(SchedulerSettings settings) : settings_(settings) {}

  /// Takes one event at `now_ms` (any steady clock that never runs backwards) and returns what is
  /// to be done, in order. Events of unknown workers and studies have no effect but the answers
  /// that the table names.
  std::vector<Effect> handle(const Event& event, std::int64_t now_ms);

  bool knows_worker(WorkerId worker) const { return workers_.contains(worker); }
  bool knows_study(StudyId study) const { return studies_.contains(study); }
  std::size_t workers() const { return workers_.size(); }
  /// How often dispatch has examined a worker, which is what dispatch costs.
  std::uint64_t examined_workers() const { return examined_workers_; }

  /// Throws std::out_of_range for an unknown study.
  StudyCounts study(StudyId study) const;
  /// Those that hold points of the study. Throws std::out_of_range for an unknown study.
  QuietWorkers quiet_workers(StudyId study, std::int64_t now_ms) const;
  /// No worker gets points before it has solved a probe; true without workers.
  bool sets_all_aside() const;
  /// All workers, by CrewState. Those count as silent of which nothing came for so long.
  std::array<Crew, kCrewStates> crews(std::int64_t now_ms, std::int64_t silent_after_ms) const;
  /// Batches that are at workers.
  std::size_t leases() const { return leases_.size(); }
  /// Time of a thread that a point takes, over the last results, in s; 0: not known.
  double thread_s_per_point() const { return pace_points_ > 0.0 ? pace_s_ / pace_points_ : 0.0; }
  /// Throws std::out_of_range for an unknown worker.
  WorkerCounts worker(WorkerId worker, std::int64_t now_ms) const;
  /// The same.
  std::uint64_t solved_points(WorkerId worker) const { return workers_.at(worker).solved_points; }
  /// Since its last message. Throws std::out_of_range for an unknown worker.
  std::int64_t silent_ms(WorkerId worker, std::int64_t now_ms) const;

  /// Throws std::logic_error when the state contradicts itself: a point in two places or in none, a
  /// lease without worker or study, a leased point without lease, two leases of one point where no
  /// batch was given to a second worker.
  void check_invariants() const;

 private:
  struct Study {
    StudyPoints points;
    std::uint64_t failed;
    bool cancelled;
    bool paused;
    bool finished;
    std::int32_t priority = 0;
    /// Batches handed out since the study was last open; long ones count for more.
    double served = 0.0;
    std::string solver_version{};  ///< of its results and leases; empty while there are none
    LeaseIndex leases{};
    bool held = false;
    bool overlaps = false;  ///< a point of it may be under several of these leases

    bool has_suspect() const {
      return points.has(Standing::kSuspect) || points.has(Standing::kAccused);
    }
  };
  struct Lease {
    WorkerId worker;
    StudyId study;
    Batch batch;
    bool alone;  ///< of suspect points: its worker gets nothing beside it
    std::int64_t granted_ms;
    LeaseId twin = 0;  ///< of another worker, for what is left of the same batch; 0: none
  };
  /// How a worker gets on with a study.
  struct Pace {
    double busy_s = 0.0;  ///< of a thread, for so many points: the last messages, weighted
    double points = 0.0;
    /// The same of messages with solved points: these alone, and the time of the whole message.
    double solved_busy_s = 0.0;
    double solved = 0.0;
    std::uint64_t last_batch_points = 0;  ///< that it was fit for
    std::uint64_t last_end = 0;           ///< place; 0: it had no batch
    std::uint64_t held_points = 0;        ///< of its leases

    double s_per_point() const { return points > 0.0 ? busy_s / points : 0.0; }  ///< 0: unknown
    double s_per_solved() const { return solved > 0.0 ? solved_busy_s / solved : 0.0; }
  };
  struct Worker {
    std::uint32_t threads;
    std::uint32_t credit = 0;
    bool is_busy = false;   ///< gets nothing
    bool draining = false;  ///< gets nothing until it holds nothing, then suspect points
    ProcessNumber process = kNobody;
    LeaseId probe = 0;                        ///< that it has, and then nothing else; 0: none
    std::optional<std::int64_t> probed_ms{};  ///< when it got its last probe
    std::int64_t last_heard_ms;
    std::int64_t stored_ms = 0;      ///< when it last stored a point, or began to hold batches
    std::size_t solved_batches = 0;  ///< since it joined or stalled
    std::uint64_t solved_points = 0;
    std::set<LeaseId> leases;
    std::map<StudyId, std::uint64_t> defined;  ///< with so many points, as it was told
    std::map<StudyId, Pace> paces;
  };
  using Effects = std::vector<Effect>;

  void on(const StudyAdded& event);
  void on(const StudyHeld& event);
  void on(const PointsTaken& event);
  void on(const StudyCancelled& event);
  void on(const StudyPaused& event);
  void on(const StudyReopened& event);
  void on(const PriorityChanged& event);
  void on(const FailuresForgotten& event);
  void on(const StudyGrown& event);
  void on(const StudyRemoved& event);
  void on(const WorkerJoined& event);
  void on(const CreditGiven& event);
  void on(const ResultsReceived& event);
  void on(const ResultsStored& event);
  void on(const HeartbeatReceived& event);
  void on(const BatchesReturned& event);
  void on(const WorkerLeft& event);
  void on(const WorkerUnreachable& event);
  void on(const WorkerBusy& event);
  void on(const DispatchHeld& event);
  void on(const Tick& event);

  enum class WorkerEnd { kLeft, kReplaced, kLost };
  Study* find_study(StudyId id);
  void end_all_leases(StudyId id);
  void withdraw(StudyId id);
  Worker* heard_from(WorkerId worker);
  /// `loss`: who went with it without an answer; nothing: its points are given back.
  void end_lease(LeaseId lease, const std::optional<Loss>& loss);
  std::vector<Interval> held_by(const Lease& lease) const;
  /// Whether points of its batch have no answer yet.
  bool has_open_points(const Lease& lease) const;
  void release_if_answered(LeaseId lease);
  void remove_worker(WorkerId worker, WorkerEnd how);
  bool names_other_points(const ResultsReceived& event) const;
  void learn_pace(Worker& worker, const ResultsReceived& event);
  void end_stalled();
  std::int64_t longest_stall_ms(const Worker& worker, std::map<StudyId, double>& paces) const;
  void finish_if_complete(StudyId id);
  bool is_open(const Study& study) const;
  StudyQueue::Place place_of(const Study& study) const;
  /// To be called after every change of a study or its points.
  void requeue(StudyId id);

  void note_loss(const Lease& lease, const std::vector<Interval>& held, Loss loss);
  void note_end(const Worker& worker, WorkerEnd how);
  void note_answers(Worker& worker, const ResultsReceived& event, bool any_accepted);
  void take_back_losses(ProcessNumber process);
  void fail_condemned();
  bool is_proven(const Worker& worker) const;
  bool is_set_aside(const Worker& worker) const;
  bool is_longest_proven(const Worker& worker) const;
  bool probe(WorkerId id, Worker& worker);
  void check_losses() const;
  void check_lines() const;

  void dispatch();
  bool serve(WorkerId id, Worker& worker);
  bool serve_suspect(WorkerId id, Worker& worker);
  std::optional<Standing> suspect_for(const Study& study, const Worker& worker) const;
  bool serve_straggler(WorkerId id, Worker& worker);
  bool is_straggling(const Lease& lease, const Worker& helper) const;
  bool is_current(const Study& study) const;
  double least_served(StudyId but) const;
  StudyId next_suspect_study(const Worker& worker) const;
  void set_draining(Worker& worker, bool is_draining);
  BatchSize portion_for(const Worker& worker, StudyId study, bool fills_lanes) const;
  void fill_lanes(BatchSize& wanted, const StudyPoints& points, std::uint32_t threads,
                  const Pace& pace) const;
  LeaseId grant(WorkerId id, Worker& worker, StudyId study, const Batch& batch, bool alone);

  /// A point that is to fail, unless it is condemned no more.
  struct Condemned {
    std::int64_t due_ms;
    StudyId study;
    std::uint64_t point;
  };

  SchedulerSettings settings_;
  WorkerProcesses processes_{settings_.most_absent_processes};
  std::deque<Condemned> condemned_;       // the one that is due first in front
  std::deque<std::int64_t> vanished_ms_;  // when the last newcomers vanished with points
  std::map<StudyId, Study> studies_;
  StudyQueue queue_;  // of the studies that have something to hand out
  std::map<WorkerId, Worker> workers_;
  std::map<LeaseId, Lease> leases_;
  ReadyQueue ready_workers_;  // with credit
  std::size_t draining_ = 0;  // workers
  std::uint64_t examined_workers_ = 0;
  std::uint64_t threads_ = 0;
  LeaseId next_lease_ = settings_.first_lease_id;
  bool held_ = false;
  bool seeks_stragglers_ = false;  // of the event being handled: they are sought at ticks only
  std::int64_t now_ms_ = 0;
  std::int64_t last_tick_ms_ = -1;
  Effects effects_;      // of the event being handled
  double pace_s_ = 0.0;  // of threads, for these points; what is longer ago counts less
  double pace_points_ = 0.0;
};

}  // namespace oblique::server
