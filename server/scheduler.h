#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "proto/recipe.h"
#include "server/lease_index.h"
#include "server/study_points.h"
#include "server/study_queue.h"

namespace oblique::server {

using StudyId = std::uint64_t;
using WorkerId = std::uint64_t;
using LeaseId = std::uint64_t;

struct SchedulerSettings {
  /// A worker silent for longer is lost: three heartbeats missed, and noticed within 3 s.
  std::int64_t lost_after_ms = 2800;
  double batch_target_s = 0.1;                ///< time a batch takes, once a worker's pace is known
  std::uint64_t first_batch_points = 4;       ///< a thread, in a batch to a worker of unknown pace
  std::uint64_t largest_batch_points = 4096;  ///< a thread
  std::uint64_t growth = 4;  ///< a batch is at most so many times the worker's last one
  /// While free points last, at least so many more batches are left for each thread: the tail of a
  /// study goes out in ever smaller batches and all workers finish together.
  std::uint64_t tail_batches_per_thread = 3;
  /// With nothing else to hand out, a batch that takes this long, and `straggler_factor` times as
  /// long as it should, is given to a second worker too; the first answer to a point wins. Batches
  /// that have cost a worker are not.
  std::int64_t straggler_after_ms = 1000;
  double straggler_factor = 4.0;
  /// A chunk whose leases cost so many workers is split; a single point of that kind fails.
  std::uint32_t max_losses = 3;
  std::uint32_t max_credit = 1024;  ///< batches a worker may ask for at a time
  /// Leases are numbered from here. A server that restarts begins above all earlier numbers, so
  /// that results of an earlier run never close a lease of this one.
  LeaseId first_lease_id = 1;
};

/// What became of one point.
struct PointOutcome {
  std::uint64_t point;
  bool failed;
};

// ---- Events -----------------------------------------------------------------------------------

/// A study that is new, or found in the database with the points that have a row.
struct StudyAdded {
  StudyId study;
  std::shared_ptr<const protocol::PointTable> table;
  IntervalSet settled;
  std::uint64_t failed = 0;  ///< how many of the settled points failed
  bool cancelled = false;
  bool paused = false;
  StudyShare share{};
  std::string solver_version{};  ///< of its results; empty while there are none
  AttemptRuns attempts{};        ///< of points that failed, also of those that were forgotten
};
/// The study's cancellation is durable.
struct StudyCancelled {
  StudyId study;
};
/// Nothing more of the study is handed out; what is handed out is still solved.
struct StudyPaused {
  StudyId study;
};
/// A cancelled or paused study goes on.
struct StudyReopened {
  StudyId study;
};
struct StudyShareChanged {
  StudyId study;
  StudyShare share;
};
/// It is durable that these points, all failed before, have no row any more.
struct FailuresForgotten {
  StudyId study;
  IntervalSet points;
  AttemptRuns attempts{};  ///< in which they failed
};
/// A worker said hello. Worker numbers are never used twice.
struct WorkerJoined {
  WorkerId worker;
  std::uint32_t threads;
  std::string solver_version{};
};
/// The worker takes so many batches more.
struct CreditGiven {
  WorkerId worker;
  std::uint32_t batches;
};
struct ResultsReceived {
  WorkerId worker;
  StudyId study;
  LeaseId lease;
  std::uint64_t sequence;  ///< the worker's number for this message
  bool batch_done;
  double busy_s;
  std::vector<PointOutcome> outcomes;
};
/// A StoreResults or StoreFailure effect is durable.
struct ResultsStored {
  WorkerId worker;  ///< 0: nobody waits for an acknowledgement
  StudyId study;
  std::uint64_t sequence;
  std::vector<PointOutcome> outcomes;
};
/// The worker lives and holds these leases.
struct HeartbeatReceived {
  WorkerId worker;
  std::vector<LeaseId> leases;
};
/// The worker said goodbye.
struct WorkerLeft {
  WorkerId worker;
};
/// A message could not be sent to the worker, or it behaves as no worker does.
struct WorkerUnreachable {
  WorkerId worker;
  std::string reason = "its connection is gone";
};
/// While held (the disk does not take results), no batch goes out.
struct DispatchHeld {
  bool held;
};
/// Time has passed.
struct Tick {};

using Event =
    std::variant<StudyAdded, StudyCancelled, StudyPaused, StudyReopened, StudyShareChanged,
                 FailuresForgotten, WorkerJoined, CreditGiven, ResultsReceived, ResultsStored,
                 HeartbeatReceived, WorkerLeft, WorkerUnreachable, DispatchHeld, Tick>;

// ---- Effects ----------------------------------------------------------------------------------

/// Tell the worker the recipe: its first batch of the study follows.
struct DefineStudy {
  WorkerId worker;
  StudyId study;
};
struct SendBatch {
  WorkerId worker;
  StudyId study;
  std::uint64_t model;
  std::uint64_t first_point;
  std::uint64_t count;
  std::uint32_t attempt;
  LeaseId lease;
};
/// Make these results of the message durable, then say ResultsStored. Sent for every Results
/// message, even with nothing to keep: the acknowledgement follows all commits before it.
struct StoreResults {
  WorkerId worker;
  StudyId study;
  std::uint64_t sequence;
  std::vector<std::size_t> accepted;  ///< indices into the event's outcomes
};
/// Make it durable that the point failed, then say ResultsStored (worker 0).
struct StoreFailure {
  StudyId study;
  std::uint64_t point;
  std::uint32_t attempt;
  std::string reason;
};
/// The results of that number are durable: tell the worker.
struct AcknowledgeResults {
  WorkerId worker;
  std::uint64_t sequence;
};
/// Tell the worker to drop the study.
struct WithdrawStudy {
  WorkerId worker;
  StudyId study;
};
/// Every point of that batch has a result from elsewhere: what is left of it need not be solved.
struct ReleaseBatch {
  WorkerId worker;
  LeaseId lease;
};
/// The worker is lost or was given up; it is unknown from now on.
struct DropWorker {
  WorkerId worker;
  std::string reason;
};
/// Every point of the study is settled.
struct StudyFinished {
  StudyId study;
};

using Effect = std::variant<DefineStudy, SendBatch, StoreResults, StoreFailure, AcknowledgeResults,
                            WithdrawStudy, ReleaseBatch, DropWorker, StudyFinished>;

// ---- State ------------------------------------------------------------------------------------

/// A study as others see it.
struct StudyCounts {
  std::uint64_t points;
  std::uint64_t solved;
  std::uint64_t failed;
  std::uint64_t leased;
  bool cancelled;
  std::string solver_version;  ///< that its results have; empty while there are none
  bool lacks_worker;           ///< points wait, and no worker has that version
};

struct WorkerCounts {
  std::uint64_t leased_points;
  std::uint64_t solved_points;
  std::int64_t silent_ms;
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

  /// Throws std::out_of_range for an unknown study.
  StudyCounts study(StudyId study) const;
  /// Throws std::out_of_range for an unknown worker.
  WorkerCounts worker(WorkerId worker, std::int64_t now_ms) const;
  /// Since its last message. Throws std::out_of_range for an unknown worker.
  std::int64_t silent_ms(WorkerId worker, std::int64_t now_ms) const;
  /// Which points of the study have a row. Throws std::out_of_range for an unknown study.
  const IntervalSet& settled(StudyId study) const {
    return studies_.at(study).points.settled_set();
  }

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
    StudyShare share;
    double served = 0.0;  ///< batches handed out over the weight, since the study was last open
    std::string solver_version{};  ///< of its results and leases; empty while there are none
    LeaseIndex leases{};
    bool overlaps = false;  ///< a point of it may be under several of these leases

    bool is_open() const { return !cancelled && !paused && !finished; }
    bool has_work() const { return is_open() && (points.has_free() || points.has_suspect()); }
  };
  struct Lease {
    WorkerId worker;
    StudyId study;
    Chunk chunk;
    bool alone;  ///< of suspect points: its worker gets nothing beside it
    std::int64_t granted_ms;
    LeaseId twin = 0;  ///< of another worker, for what is left of the same batch; 0: none
  };
  struct Pace {
    double s_per_point = 0.0;  ///< 0: unknown
    std::uint64_t last_batch_points = 0;
  };
  struct Worker {
    std::uint32_t threads;
    std::string solver_version;
    std::uint32_t credit = 0;
    bool queued = false;    ///< stands in `ready_workers_`
    bool draining = false;  ///< gets nothing until it holds nothing, then suspect points
    std::int64_t last_heard_ms;
    std::uint64_t solved_points = 0;
    std::set<LeaseId> leases;
    std::set<StudyId> defined;
    std::map<StudyId, Pace> paces;
  };
  using Effects = std::vector<Effect>;

  void on(const StudyAdded& event);
  void on(const StudyCancelled& event);
  void on(const StudyPaused& event);
  void on(const StudyReopened& event);
  void on(const StudyShareChanged& event);
  void on(const FailuresForgotten& event);
  void on(const WorkerJoined& event);
  void on(const CreditGiven& event);
  void on(const ResultsReceived& event);
  void on(const ResultsStored& event);
  void on(const HeartbeatReceived& event);
  void on(const WorkerLeft& event);
  void on(const WorkerUnreachable& event);
  void on(const DispatchHeld& event);
  void on(const Tick& event);

  enum class LeaseEnd { kReturned, kLost };
  Worker* heard_from(WorkerId worker);
  void end_lease(LeaseId lease, LeaseEnd how);
  std::vector<Interval> held_by(const Lease& lease) const;
  void give_back_lost(StudyId study, const Interval& run, const Lease& lease);
  void release_if_answered(LeaseId lease);
  void remove_worker(WorkerId worker, LeaseEnd how);
  void learn_pace(Worker& worker, const ResultsReceived& event);
  void finish_if_complete(StudyId id);
  StudyQueue::Place place_of(const Study& study) const;
  /// To be called after every change of a study or its points.
  void requeue(StudyId id);

  void dispatch();
  bool serve(WorkerId id, Worker& worker);
  bool serve_suspect(WorkerId id, Worker& worker);
  bool serve_straggler(WorkerId id, Worker& worker);
  bool is_straggling(const Lease& lease, const Worker& helper) const;
  static bool admits(const Study& study, const Worker& worker);
  StudyId next_free_study(const Worker& worker) const;
  double least_served(StudyId but) const;
  StudyId next_suspect_study(const Worker& worker) const;
  bool anyone_draining() const;
  std::uint64_t batch_points(const Worker& worker, StudyId study) const;
  LeaseId grant(WorkerId id, Worker& worker, StudyId study, const Chunk& chunk, bool alone);
  void queue(WorkerId id, Worker& worker);

  SchedulerSettings settings_;
  std::map<StudyId, Study> studies_;
  StudyQueue queue_;  // of the studies that have something to hand out
  std::map<WorkerId, Worker> workers_;
  std::map<LeaseId, Lease> leases_;
  std::deque<WorkerId> ready_workers_;  // with credit, first come first served
  std::uint64_t threads_ = 0;
  LeaseId next_lease_ = settings_.first_lease_id;
  bool held_ = false;
  bool seeks_stragglers_ = false;  // of the event being handled: they are sought at ticks only
  std::int64_t now_ms_ = 0;
  std::int64_t last_tick_ms_ = -1;
  Effects effects_;  // of the event being handled
};

}  // namespace oblique::server
