#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "server/scheduler/losses.h"
#include "server/study/interval_set.h"
#include "server/study/limits.h"
#include "server/study/study_table.h"

// The events that the scheduler handles and the effects that it requests.
namespace oblique::server {

using LeaseId = std::uint64_t;

struct SchedulerSettings {
  /// A worker silent for longer is lost: three missed heartbeats, noticed within 3 s.
  std::int64_t lost_after_ms = 2800;
  double batch_target_s = 0.1;                ///< duration of a batch once a worker's pace is known
  std::uint64_t first_batch_points = 4;       ///< a thread, for a worker of unknown pace
  std::uint64_t largest_batch_points = 4096;  ///< a thread
  /// Points, or falls of models, that a thread solves side by side in nearly the time of one. A
  /// batch has at least so many a thread,
  std::uint64_t lanes = 8;
  double lanes_batch_s = 10.0;  ///< unless its points would take longer than this,
  double models_batch_s = 1.0;  ///< or its models longer than this.
  std::uint64_t growth = 4;     ///< largest factor between a worker's successive batches
  /// While free points last, so many more batches are left for each thread: batches shrink toward
  /// the end of a study and all workers finish together.
  std::uint64_t tail_batches_per_thread = 3;
  double shortest_batch_s = 0.01;  ///< transport costs more than shorter batches gain
  /// With nothing else to hand out, a batch that takes this long, and `straggler_factor` times as
  /// long as expected, is also given to a second worker. Batches that lost a worker are not.
  std::int64_t straggler_after_ms = 1000;
  double straggler_factor = 4.0;
  LossLimits loss_limits{};
  std::uint64_t suspect_parts = 8;  ///< number of parts into which a suspect interval is split
  /// A condemned point fails unless a process that it cost says hello again within this time.
  std::int64_t return_within_ms = 10'000;
  /// An accused point is kept for the longest proven worker for so long.
  std::int64_t longest_proven_within_ms = 10'000;
  /// A process that was lost so often in a row is set aside until it has solved a probe.
  std::uint32_t set_aside_after = 3;
  /// So is every newcomer while so many of them vanished with points in this time.
  std::size_t vanished_newcomers = 3;
  std::int64_t newcomers_watched_ms = 60'000;
  std::int64_t probe_interval_ms = 1000;  ///< between two probes of one worker
  /// A worker holds at most so many batches more than it has solved since it joined or stalled.
  std::size_t newcomer_batches = 2;
  /// A worker that stores nothing for so many times the expected duration of its longest batch has
  /// stalled, within these limits; its batches go to others.
  double stall_factor = 10.0;
  std::int64_t shortest_stall_ms = 60'000;
  std::int64_t longest_stall_ms = 3'600'000;
  std::size_t most_absent_processes = 4096;    ///< that are gone and remembered
  std::uint32_t max_credit = limits::kCredit;  ///< batches
  /// Points a thread in a batch of a filtered study before the worker has solved one: the filter
  /// may keep all of them.
  std::uint64_t unsolved_batch_points = 256;
  /// A restarted server numbers leases above all earlier ones, so that results of an earlier run
  /// never end a lease of this one.
  LeaseId first_lease_id = 1;
};

struct PointOutcome {
  std::uint64_t point;
  bool failed;
};

// ---- Events -----------------------------------------------------------------------------------

/// A new study, or one restored from the database.
struct StudyAdded {
  StudyId study;
  StudyTable table;
  IntervalSet completed;     ///< points with a row, or left out by a filter
  std::uint64_t failed = 0;  ///< number of completed points that failed
  bool cancelled = false;
  bool paused = false;
  std::int32_t priority = 0;
  std::string solver_version{};  ///< of its results; empty without results
  bool held = false;
  std::uint64_t left_out = 0;  ///< number of completed points that a filter leaves out
};
/// A held study is not handed out, whatever else happens to it.
struct StudyHeld {
  StudyId study;
  bool held;
};
/// It is durable that these points have rows copied from other studies.
struct PointsReused {
  StudyId study;
  IntervalSet points;
};
/// The cancellation is durable.
struct StudyCancelled {
  StudyId study;
};
/// The study gets no further batches. Batches that workers hold are still solved.
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
/// It is durable that these failed points have no row any more.
struct FailuresForgotten {
  StudyId study;
  IntervalSet points;
};
/// It is durable that the study has further points after its earlier ones, and runs.
struct StudyGrown {
  StudyId study;
  StudyTable table;  ///< of all its points
  std::int32_t priority = 0;
};
/// The deletion is durable. Study numbers are never reused.
struct StudyRemoved {
  StudyId study;
};
/// Worker numbers are never reused.
struct WorkerJoined {
  WorkerId worker;
  std::uint32_t threads;
  std::string process{};  ///< an earlier connection of this process has ended; empty: unknown
};
struct CreditGiven {
  WorkerId worker;
  std::uint32_t batches;
};
struct ResultsReceived {
  WorkerId worker;
  StudyId study;
  LeaseId lease;
  std::uint64_t sequence;  ///< the worker's number of this message
  bool batch_done;
  double busy_s;
  std::vector<PointOutcome> outcomes;
  IntervalSet left_out{};  ///< points of the lease that a filter leaves out
};
/// A StoreResults or StoreFailure effect is durable.
struct ResultsStored {
  WorkerId worker;  ///< 0: nothing to acknowledge
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
/// The worker will not finish these batches.
struct BatchesReturned {
  WorkerId worker;
  std::vector<LeaseId> leases;
};
/// The worker said goodbye.
struct WorkerLeft {
  WorkerId worker;
};
/// A message could not be sent to the worker, or it violates the protocol.
struct WorkerUnreachable {
  WorkerId worker;
  std::string reason = "its connection is gone";
  std::vector<LeaseId> unsent{};  ///< batches that were not sent, so their points are not suspect
};
/// A busy worker does not read what it is sent and gets no batch. No sign of life.
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
    std::variant<StudyAdded, StudyHeld, PointsReused, StudyCancelled, StudyPaused, StudyReopened,
                 PriorityChanged, FailuresForgotten, StudyGrown, StudyRemoved, WorkerJoined,
                 CreditGiven, ResultsReceived, ResultsStored, HeartbeatReceived, BatchesReturned,
                 WorkerLeft, WorkerUnreachable, WorkerBusy, DispatchHeld, Tick>;

// ---- Effects ----------------------------------------------------------------------------------

/// Send the recipe: a batch of the study, or of points that it has grown by, follows.
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

  std::uint64_t first_point() const { return points.front().begin; }
  std::uint64_t count() const { return size_of(points); }
};
/// Store these results, then feed ResultsStored. One for each Results message, even with nothing
/// to store: the acknowledgement follows all commits before it.
struct StoreResults {
  WorkerId worker;
  StudyId study;
  std::uint64_t sequence;
  std::vector<std::size_t> accepted;  ///< indices into the event's outcomes
  IntervalSet left_out{};             ///< points that a filter leaves out
};
/// Store that the point failed, then feed ResultsStored (worker 0).
struct StoreFailure {
  StudyId study;
  std::uint64_t point;
  std::uint32_t attempt;
  std::string reason;
};
/// The results of that message are durable.
struct AcknowledgeResults {
  WorkerId worker;
  std::uint64_t sequence;
};
/// Send an easy point of kProbeStudy, whose result is not stored.
struct SendProbe {
  WorkerId worker;
  LeaseId lease;
};
/// The worker should drop the study.
struct WithdrawStudy {
  WorkerId worker;
  StudyId study;
};
/// The worker should drop the rest of the batch: its points are answered or given to others.
struct ReleaseBatch {
  WorkerId worker;
  LeaseId lease;
};
/// The worker is lost; it is unknown from now on.
struct DropWorker {
  WorkerId worker;
  std::string reason;
};
/// Every point of the study is completed.
struct StudyFinished {
  StudyId study;
};

using Effect =
    std::variant<DefineStudy, SendBatch, SendProbe, StoreResults, StoreFailure, AcknowledgeResults,
                 WithdrawStudy, ReleaseBatch, DropWorker, StudyFinished>;

/// No study has this number.
constexpr StudyId kProbeStudy = 0;

}  // namespace oblique::server
