#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "server/scheduler/scheduler_events.h"
#include "server/scheduler/study_points.h"

namespace oblique::server {

/// Counts of the points of a study.
struct StudyCounts {
  std::uint64_t points;
  std::uint64_t completed;  ///< includes failed and left-out points
  std::uint64_t failed;
  std::uint64_t left_out;  ///< number of points left out by a filter, as reported by workers so far
  std::uint64_t leased;
  bool cancelled;
  std::string solver_version;  ///< solver version of the study's results; empty without results
  bool is_of_other_solver;     ///< true if the study's open points need another solver version

  std::uint64_t open() const { return points - completed; }
  std::uint64_t solved() const { return completed - std::min(completed, failed + left_out); }
};

/// State of a worker. If several apply, the first one counts.
enum class WorkerState {
  kSilent,   ///< has sent nothing for 1.5 s; heartbeats come every 900 ms
  kStalled,  ///< stored nothing for too long, so it gets no batch for a while
  kBusy,     ///< does not read its messages
  kWorking,  ///< holds a batch
  kIdle,
};
inline constexpr std::array kWorkerStates{"silent", "stalled", "busy", "working", "idle"};

/// Number of workers in one state, and the number of their threads.
struct WorkerGroup {
  std::uint64_t workers = 0;
  std::uint64_t threads = 0;
};
using WorkerGroups = std::array<WorkerGroup, kWorkerStates.size()>;

struct WorkerCounts {
  std::uint64_t leased_points;
  std::uint64_t solved_points;
  std::int64_t silent_ms;
  std::uint64_t losses;  ///< number of leases of the worker's process that ended without an answer
  WorkerState state;
};

/// The workers that accept further batches, first come, first served. A worker without suitable
/// points is parked: it keeps its place and is skipped until something changes for it. So the cost
/// of an event depends on what it changes, not on the number of waiting workers.
class ReadyQueue {
 public:
  using ByPlace = std::map<std::uint64_t, WorkerId>;

  /// Appends a worker that is not in the queue yet.
  void add(WorkerId worker) {
    if (places_.emplace(worker, last_place_ + 1).second) {
      active_.emplace(++last_place_, worker);
    }
  }
  void remove(WorkerId worker) {
    if (const auto found = places_.find(worker); found != places_.end()) {
      active_.erase(found->second);
      parked_.erase(found->second);
      places_.erase(found);
    }
  }
  void park(WorkerId worker) { move(worker, active_, parked_); }
  void unpark(WorkerId worker) { move(worker, parked_, active_); }
  void unpark_all() { active_.merge(parked_); }

  bool contains(WorkerId worker) const { return places_.contains(worker); }
  std::size_t size() const { return places_.size(); }
  /// Workers in order of service.
  const ByPlace& active() const { return active_; }
  const ByPlace& parked() const { return parked_; }

 private:
  void move(WorkerId worker, ByPlace& from, ByPlace& to) {
    if (const auto found = places_.find(worker); found != places_.end()) {
      to.insert(from.extract(found->second));
    }
  }

  std::unordered_map<WorkerId, std::uint64_t> places_;
  ByPlace active_;
  ByPlace parked_;
  std::uint64_t last_place_ = 0;
};

/// Decides which worker solves which points: (state, event, now) -> effects. Has no I/O, clock,
/// thread or randomness. README.md has the table of states and events. Not thread-safe.
class Scheduler {
 public:
  /// `solver_version` is the version of the server and of all its workers. A study with results of
  /// another version is not leased.
  explicit Scheduler(const SchedulerSettings& settings, std::string solver_version = {})
      : settings_(settings), solver_version_(std::move(solver_version)) {}

  /// Handles one event and returns the effects in order. `now_ms` comes from a clock that never
  /// runs backwards. README.md lists the effects of events about unknown workers and studies.
  std::vector<Effect> handle(const Event& event, std::int64_t now_ms);

  bool has_worker(WorkerId worker) const { return workers_.contains(worker); }
  bool has_study(StudyId study) const { return studies_.contains(study); }
  bool has_lease(WorkerId worker, LeaseId lease, StudyId study) const {
    const auto found = leases_.find(lease);
    return found != leases_.end() && found->second.worker == worker && found->second.study == study;
  }
  std::size_t workers() const { return workers_.size(); }
  /// Returns the number of workers that dispatch has examined so far, which measures its cost.
  std::uint64_t examined_workers() const { return examined_workers_; }

  /// Throws std::out_of_range for an unknown study.
  StudyCounts study(StudyId study) const;
  /// Returns whether no worker may get points.
  bool are_all_stalled() const;
  /// Returns the number of workers in each WorkerState.
  WorkerGroups groups(std::int64_t now_ms) const;
  /// Number of leased batches.
  std::size_t leases() const { return leases_.size(); }
  /// Returns the recent thread time per point [s]; 0 if it is unknown.
  double thread_s_per_point() const { return pace_points_ > 0.0 ? pace_s_ / pace_points_ : 0.0; }
  /// Throws std::out_of_range for an unknown worker.
  WorkerCounts worker(WorkerId worker, std::int64_t now_ms) const;
  /// Returns the time since the worker's last message [ms]. Throws std::out_of_range for an unknown
  /// worker.
  std::int64_t silent_ms(WorkerId worker, std::int64_t now_ms) const;

  /// Throws std::logic_error if the state contradicts itself: a point is in two places or in none,
  /// a lease has no worker or study, a leased point has no lease, or a point has two leases that
  /// are not twins (Lease::twin).
  void check_invariants() const;

 private:
  /// Sort key of studies that wait for workers: minus the priority, then `served`, then the ID.
  using Rank = std::tuple<std::int64_t, double, StudyId>;
  struct Study {
    StudyPoints points;
    std::uint64_t failed;
    bool cancelled;
    bool paused;
    bool finished;
    std::int32_t priority = 0;
    /// Leased batches plus the start value from `level`. A long batch counts for several.
    double served = 0.0;
    std::string solver_version{};  ///< solver version of results and leases; empty without them
    std::set<LeaseId> leases{};
    bool held = false;
    std::optional<Rank> rank{};  ///< the study's entry in `free_`
  };
  struct Lease {
    WorkerId worker;
    StudyId study;
    Batch batch;
    bool alone;  ///< true for a suspect point; the worker then gets no other lease
    std::int64_t granted_ms;
    LeaseId twin = 0;  ///< another worker's lease for the rest of this batch; 0 if there is none
  };
  /// How fast a worker solves points of a study.
  struct Pace {
    double busy_s = 0.0;  ///< thread time for `points`; recent messages have more weight
    double points = 0.0;
    /// Like `busy_s` and `points`, but for solved points only. Messages without solved points do
    /// not count.
    double solved_busy_s = 0.0;
    double solved = 0.0;
    std::uint64_t last_batch_points = 0;  ///< size of the last batch, or the wanted size if larger
    std::uint64_t last_end = 0;     ///< place at which the last batch ended; 0 before the first one
    std::uint64_t held_points = 0;  ///< number of points in the worker's leases of the study

    double s_per_point() const { return points > 0.0 ? busy_s / points : 0.0; }  ///< 0 if unknown
    double s_per_solved() const { return solved > 0.0 ? solved_busy_s / solved : 0.0; }
  };
  struct Worker {
    std::uint32_t threads;
    std::uint32_t credit = 0;
    bool is_busy = false;      ///< the worker does not read its messages, so it gets no batch
    std::string process;       ///< ID of its process; empty if unknown
    std::uint64_t losses = 0;  ///< number of leases of its process that ended without an answer
    std::int64_t stalled_until_ms = 0;
    /// The process before this one was lost with a suspect point, so other points come first.
    bool is_spared = false;
    std::int64_t last_heard_ms;
    std::int64_t stored_ms = 0;      ///< when it last stored a point or began to hold leases
    std::size_t solved_batches = 0;  ///< number of batches solved since it joined or stalled
    std::uint64_t solved_points = 0;
    std::set<LeaseId> leases;
    std::map<StudyId, std::uint64_t> defined;  ///< size of each study whose recipe the worker has
    std::map<StudyId, Pace> paces;
  };
  /// The leases that a lost worker process held when it was lost.
  struct LostProcess {
    struct Points {
      StudyId study;
      IntervalSet points;
      bool alone;  ///< true if the process held only this point
    };
    std::uint64_t losses = 0;  ///< number of its leases that ended without an answer
    std::vector<Points> held{};
  };
  using Effects = std::vector<Effect>;

  template <typename Kind>
  void pass(const Kind& event);
  void on(const StudyAdded& event);
  void on(Study& study, const StudyHeld& event);
  void on(Study& study, const PointsReused& event);
  void on(Study& study, const StudyCancelled& event);
  void on(Study& study, const StudyPaused& event);
  void on(Study& study, const StudyReopened& event);
  void on(Study& study, const PriorityChanged& event);
  void on(Study& study, const FailuresForgotten& event);
  void on(Study& study, const StudyGrown& event);
  void on(const StudyRemoved& event);
  void on(const WorkerJoined& event);
  void on(Worker& worker, const CreditGiven& event);
  void on(Worker& worker, const ResultsReceived& event);
  void on(const ResultsStored& event);
  void on(Worker& worker, const HeartbeatReceived& event);
  void on(Worker& worker, const BatchesReturned& event);
  void on(const WorkerLeft& event);
  void on(const WorkerUnreachable& event);
  void on(const WorkerBusy& event);
  void on(const DispatchHeld& event);
  void on(const Tick& event);

  enum class WorkerEnd { kLeft, kReplaced, kLost };
  void withdraw(StudyId id);
  void end_lease(LeaseId lease, bool is_lost = false);
  void release_leases(const Study& study, const IntervalSet& places);
  /// Returns the places of the lease's points that have no answer yet.
  std::vector<Interval> open_places(const Lease& lease) const;
  bool has_open_points(const Lease& lease) const { return !open_places(lease).empty(); }
  void release_if_answered(LeaseId lease);
  void remove_worker(WorkerId worker, WorkerEnd how);
  bool reports_foreign_points(const ResultsReceived& event) const;
  void update_pace(Worker& worker, const ResultsReceived& event);
  /// Shortest thread time per point that any worker needs, by study; 0 if it is unknown.
  using FastestPaces = std::map<StudyId, double>;
  double fastest_pace(StudyId id, FastestPaces& known) const;
  void end_stalled();
  std::int64_t longest_stall_ms(const Worker& worker, FastestPaces& paces) const;
  void finish_if_complete(StudyId id);
  bool is_open(const Study& study) const;
  std::optional<Rank> rank_of(StudyId id, const Study& study) const;
  void level(Study& study) const;
  /// Updates the queues of studies. Must be called after every change of a study or its points.
  void requeue(StudyId id);

  WorkerState state_of(const Worker& worker, std::int64_t now_ms) const;
  void end_connection(const std::string& process, WorkerEnd how, const std::string& reason);
  void note_end(const Worker& worker, WorkerEnd how);
  LostProcess take_lost(const std::string& process);
  void forgive(const LostProcess& returned);
  void blame(const LostProcess& lost, const EndedProcess& ended);
  LeaseHistory* history_of(Study& study, std::uint64_t point);
  void fail_point(StudyId study, std::uint64_t point, std::uint32_t attempts, std::string reason);
  void stall(Worker& worker, std::int64_t duration_ms);
  bool is_stalled(const Worker& worker) const { return now_ms_ < worker.stalled_until_ms; }
  void check_leases() const;
  void check_workers() const;

  void dispatch();
  bool serve(WorkerId id, Worker& worker);
  bool may_hold_more(const Worker& worker) const;
  void duplicate_stragglers();
  bool is_straggling(const Lease& lease, FastestPaces& paces) const;
  bool is_current(const Study& study) const;
  BatchSize batch_size_for(const Worker& worker, StudyId study) const;
  void fill_lanes(BatchSize& wanted, const StudyPoints& points, std::uint32_t threads,
                  const Pace& pace) const;
  void use_credit(WorkerId id, Worker& worker);
  LeaseId grant(WorkerId id, Worker& worker, StudyId study, const Batch& batch, bool alone);

  SchedulerSettings settings_;
  std::string solver_version_;
  std::map<StudyId, Study> studies_;
  std::set<Rank> free_;         // studies with free points to lease, in the order of service
  std::set<StudyId> suspects_;  // studies with suspect points to lease
  std::map<WorkerId, Worker> workers_;
  std::map<std::string, WorkerId> connections_;  // workers by the ID of their process
  std::map<std::string, LostProcess> lost_;      // processes that may return or be replaced
  std::map<LeaseId, Lease> leases_;
  ReadyQueue ready_workers_;  // workers with credit
  std::uint64_t examined_workers_ = 0;
  std::uint64_t threads_ = 0;
  LeaseId next_lease_ = settings_.first_lease_id;
  bool held_ = false;
  std::int64_t now_ms_ = 0;
  std::int64_t last_tick_ms_ = -1;
  Effects effects_;      // effects of the current event
  double pace_s_ = 0.0;  // thread time for `pace_points_`; recent results have more weight
  double pace_points_ = 0.0;
};

}  // namespace oblique::server
