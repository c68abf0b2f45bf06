#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "server/scheduler/points/loss_history.h"
#include "server/scheduler/points/study_points.h"
#include "server/scheduler/worker_processes.h"
#include "server/study/interval_set.h"
#include "server/study/limits.h"
#include "server/study/point_attempts.h"

// What the scheduler is told, and what it wants done.
namespace oblique::server {

using LeaseId = std::uint64_t;

struct SchedulerSettings {
  /// A worker silent for longer is lost: three heartbeats missed, and noticed within 3 s.
  std::int64_t lost_after_ms = 2800;
  double batch_target_s = 0.1;  ///< time a batch takes, once a worker's pace is known
  /// With so many workers that they would ask for more, batches take longer.
  double most_batches_per_s = 10'000;
  std::uint64_t first_batch_points = 4;       ///< a thread, in a batch to a worker of unknown pace
  std::uint64_t largest_batch_points = 4096;  ///< a thread
  /// Points, and falls of models, that a thread solves side by side in nearly the time of one:
  /// while a study has them, a batch has so many points a thread, or so many models.
  std::uint64_t lanes = 8;
  double lanes_batch_s = 10.0;  ///< a batch is not made longer than this to fill lanes with points,
  double models_batch_s = 1.0;  ///< nor than this to end with a model, or to fill them with models
  std::uint64_t growth = 4;     ///< a batch is at most so many times the worker's last one
  /// While free points last, at least so many more batches are left for each thread: the tail of a
  /// study goes out in ever smaller batches and all workers finish together.
  std::uint64_t tail_batches_per_thread = 3;
  double shortest_batch_s =
      0.01;  ///< of those too: shorter ones cost more on their way than they help
  /// With nothing else to hand out, a batch that takes this long, and `straggler_factor` times as
  /// long as it should, is given to a second worker too; the first answer to a point wins. Batches
  /// that have cost a worker are not.
  std::int64_t straggler_after_ms = 1000;
  double straggler_factor = 4.0;
  /// From how many losses on points are leased alone, and from how many of those a single point
  /// fails.
  LossLimits loss_limits{};
  std::uint64_t suspect_parts = 8;  ///< into so many parts a suspect interval is split
  /// A condemned point fails when none of the processes that it cost says hello again for so long.
  std::int64_t return_within_ms = 10'000;
  /// An accused point goes to the worker that has been proven longest, after so long to any.
  std::int64_t longest_proven_within_ms = 10'000;
  /// A process that was lost so often without solving anything between is set aside: it gets no
  /// points until it has solved a probe.
  std::uint32_t set_aside_after = 3;
  /// The same goes for every newcomer, when so many of them vanished with points in this time.
  std::size_t vanished_newcomers = 3;
  std::int64_t newcomers_watched_ms = 60'000;
  std::int64_t probe_interval_ms = 1000;  ///< between two probes of one worker
  /// A worker holds at most so many batches more than it has solved since it joined or stalled.
  std::size_t newcomer_batches = 2;
  /// A worker stalls, and its batches go to others, when it stores nothing for so many times what
  /// one of them takes at the fastest known pace of its study, within these limits.
  double stall_factor = 10.0;
  std::int64_t shortest_stall_ms = 60'000;
  std::int64_t longest_stall_ms = 3'600'000;
  std::size_t most_absent_processes = 1024;    ///< are remembered, of newcomers and of others each
  std::uint32_t max_credit = limits::kCredit;  ///< batches a worker may ask for at a time
  /// Points a thread that a batch of a filtered study has at most before the worker has solved one:
  /// the filter may leave in all of them.
  std::uint64_t unsolved_batch_points = 256;
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

/// A study that is new, or found in the database with the points that have a row or are left out.
struct StudyAdded {
  StudyId study;
  StudyTable table;
  IntervalSet settled;
  std::uint64_t failed = 0;  ///< how many of the settled points failed
  bool cancelled = false;
  bool paused = false;
  std::int32_t priority = 0;
  std::string solver_version{};  ///< of its results; empty while there are none
  PointAttempts attempts{};      ///< of points that failed, also of those that were forgotten
  bool held = false;             ///< as StudyHeld says
  std::uint64_t left_out = 0;    ///< how many of the settled points a filter leaves out
};
/// While a study is held nothing of it is handed out, whatever else happens to it.
struct StudyHeld {
  StudyId study;
  bool held;
};
/// It is durable that these points, which are of that solver version, have rows from elsewhere.
struct PointsTaken {
  StudyId study;
  IntervalSet points;
  std::string solver_version;
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
struct PriorityChanged {
  StudyId study;
  std::int32_t priority = 0;
};
/// It is durable that these points, all failed before, have no row any more.
struct FailuresForgotten {
  StudyId study;
  IntervalSet points;
  PointAttempts attempts{};  ///< in which they failed
};
/// It is durable that the study has further points behind those that it had, and runs.
struct StudyGrown {
  StudyId study;
  StudyTable table;  ///< of all its points
  std::int32_t priority = 0;
};
/// It is durable that there is no such study any more. Numbers of studies are never used twice.
struct StudyRemoved {
  StudyId study;
};
/// A worker said hello. Worker numbers are never used twice.
struct WorkerJoined {
  WorkerId worker;
  std::uint32_t threads;
  std::string solver_version{};
  std::string process{};                ///< that it is a connection of; empty: nobody knows
  bool process_has_one_worker = false;  ///< its earlier connections have ended, if it had any
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
  IntervalSet left_out{};  ///< points of the lease that a filter leaves out
};
/// A StoreResults or StoreFailure effect is durable.
struct ResultsStored {
  WorkerId worker;  ///< 0: nobody waits for an acknowledgement
  StudyId study;
  std::uint64_t sequence;
  std::vector<PointOutcome> outcomes;
  IntervalSet left_out{};
};
/// The worker lives and holds these leases.
struct HeartbeatReceived {
  WorkerId worker;
  std::vector<LeaseId> leases;
};
/// The worker will not end these batches, and says so.
struct BatchesReturned {
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
  std::vector<LeaseId> unsent{};  ///< whose batches could not go out: they say nothing of points
};
/// While so much waits to go out to the worker, it gets nothing more. No sign of life.
struct WorkerBusy {
  WorkerId worker;
  bool is_busy;
};
/// While held (the disk does not take results), no batch goes out.
struct DispatchHeld {
  bool held;
};
/// Time has passed.
struct Tick {};

using Event =
    std::variant<StudyAdded, StudyHeld, PointsTaken, StudyCancelled, StudyPaused, StudyReopened,
                 PriorityChanged, FailuresForgotten, StudyGrown, StudyRemoved, WorkerJoined,
                 CreditGiven, ResultsReceived, ResultsStored, HeartbeatReceived, BatchesReturned,
                 WorkerLeft, WorkerUnreachable, WorkerBusy, DispatchHeld, Tick>;

// ---- Effects ----------------------------------------------------------------------------------

/// Tell the worker the recipe: its first batch of the study, or of points that the study has got
/// since, follows.
struct DefineStudy {
  WorkerId worker;
  StudyId study;
};
struct SendBatch {
  WorkerId worker;
  StudyId study;
  std::vector<Interval> points;  ///< in the order in which they are to be solved
  std::uint32_t attempt;
  LeaseId lease;
  std::int32_t priority = 0;  ///< of the study

  std::uint64_t first_point() const { return points.front().begin; }
  std::uint64_t count() const { return size_of(points); }
};
/// Make these results of the message durable, then say ResultsStored. Sent for every Results
/// message, even with nothing to keep: the acknowledgement follows all commits before it.
struct StoreResults {
  WorkerId worker;
  StudyId study;
  std::uint64_t sequence;
  std::vector<std::size_t> accepted;  ///< indices into the event's outcomes
  IntervalSet left_out{};             ///< points that a filter leaves out
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
/// Give the worker the probe under that lease: a point that every sound worker solves, and whose
/// answer nobody needs. Its results are of `kProbeStudy`.
struct SendProbe {
  WorkerId worker;
  LeaseId lease;
};
/// Tell the worker to drop the study.
struct WithdrawStudy {
  WorkerId worker;
  StudyId study;
};
/// What is left of that batch need not be solved: every point has a result from elsewhere, or
/// others get what has none.
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

using Effect =
    std::variant<DefineStudy, SendBatch, SendProbe, StoreResults, StoreFailure, AcknowledgeResults,
                 WithdrawStudy, ReleaseBatch, DropWorker, StudyFinished>;

/// No study has this number.
constexpr StudyId kProbeStudy = 0;

}  // namespace oblique::server
