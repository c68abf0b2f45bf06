#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "server/study/interval_set.h"
#include "server/study/limits.h"
#include "server/study/study_table.h"

// Events that the scheduler handles, and effects that it returns.
namespace oblique::server {

using StudyId = std::uint64_t;
using WorkerId = std::uint64_t;
using LeaseId = std::uint64_t;

struct SchedulerSettings {
  /// A worker counts as lost after this silence: three missed heartbeats. The server notices the
  /// loss within 3 s.
  std::int64_t lost_after_ms = 2800;
  double batch_target_s = 0.1;                ///< target duration of a batch if the pace is known
  std::uint64_t first_batch_points = 4;       ///< points per thread if the pace is unknown
  std::uint64_t largest_batch_points = 4096;  ///< maximum number of points per thread in a batch
  /// Number of points, or of models' falls, that a thread solves side by side in nearly the time of
  /// a single one. A batch has at least this number per thread, unless that would take too long.
  std::uint64_t lanes = 8;
  double lanes_batch_s = 10.0;  ///< maximum duration of a batch enlarged to fill lanes with points
  double models_batch_s = 1.0;  ///< maximum duration of a batch enlarged to fill lanes with models
  std::uint64_t growth = 4;     ///< maximum growth factor from one batch of a worker to the next
  /// A batch has at most the free points per thread divided by this. So batches shrink toward the
  /// end of a study, and all workers finish together.
  std::uint64_t tail_batches_per_thread = 3;
  double shortest_batch_s = 0.01;  ///< shorter batches cost too much in transport
  /// If no other points can be leased, a second worker also gets each batch that takes longer than
  /// this and longer than `straggler_factor` times its expected duration. Batches with losses are
  /// excluded.
  std::int64_t straggler_after_ms = 1000;
  double straggler_factor = 4.0;
  /// A point fails if this number of workers in a row were lost while they held only this point,
  /// over at least `failing_after_ms`.
  std::uint32_t failing_after = 20;
  std::int64_t failing_after_ms = 600'000;
  /// A worker holds at most this many batches more than it has solved since it joined or stalled.
  std::size_t newcomer_batches = 2;
  /// A worker has stalled if it stores nothing for this multiple of the expected duration of its
  /// longest batch, within the limits below. Its batches then go to others, and it gets none for as
  /// long again, unless it stores something.
  double stall_factor = 10.0;
  std::int64_t shortest_stall_ms = 60'000;
  std::int64_t longest_stall_ms = 3'600'000;
  std::size_t most_lost_processes = 1024;      ///< maximum number of lost processes that are kept
  std::uint32_t max_credit = limits::kCredit;  ///< batches that a worker may request at a time
  /// Points per thread in a worker's first batch of a filtered study. The batch is small, because
  /// all of its points may pass the filter.
  std::uint64_t unsolved_batch_points = 256;
  /// First lease number. It is above all numbers of earlier runs of the server, so that a late
  /// result never ends a lease of this run.
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
  IntervalSet completed;     ///< points that have a row or are left out by a filter
  std::uint64_t failed = 0;  ///< number of completed points that failed
  bool cancelled = false;
  bool paused = false;
  std::int32_t priority = 0;
  std::string solver_version{};  ///< solver version of the study's results; empty without results
  bool held = false;
  std::uint64_t left_out = 0;  ///< number of completed points that a filter leaves out
};
/// A held study gets no leases, whatever its state is.
struct StudyHeld {
  StudyId study;
  bool held;
};
/// Rows of these points were copied from other studies and are durable.
struct PointsReused {
  StudyId study;
  IntervalSet points;
};
/// The cancellation is durable.
struct StudyCancelled {
  StudyId study;
};
/// The study gets no further batches. Workers finish the batches that they hold.
struct StudyPaused {
  StudyId study;
};
/// A cancelled or paused study continues.
struct StudyReopened {
  StudyId study;
};
struct PriorityChanged {
  StudyId study;
  std::int32_t priority = 0;
};
/// The deletion of the rows of these failed points is durable.
struct FailuresForgotten {
  StudyId study;
  IntervalSet points;
};
/// The added points of the study are durable, and the study runs.
struct StudyGrown {
  StudyId study;
  StudyTable table;  ///< contains all points, also the earlier ones
  std::int32_t priority = 0;
};
/// The deletion of the study is durable. Study numbers are never reused.
struct StudyRemoved {
  StudyId study;
};
/// A worker process that a signal has ended.
struct EndedProcess {
  std::string process;  ///< ID of the process
  int signal = 0;
  /// points that its solver was solving, if the signal is a crash; else empty
  std::set<std::pair<StudyId, std::uint64_t>> points{};
};
/// A worker has connected. It replaces the earlier worker of its process, and the worker of the
/// process that ended before its own. Its number is never reused.
struct WorkerJoined {
  WorkerId worker;
  std::uint32_t threads;
  std::string process{};  ///< ID of the worker's process; empty if unknown
  std::optional<EndedProcess> replaced{};
};
struct CreditGiven {
  WorkerId worker;
  std::uint32_t batches;
};
struct ResultsReceived {
  WorkerId worker;
  StudyId study;
  LeaseId lease;
  std::uint64_t sequence;  ///< number that the worker gave this message
  bool batch_done;
  double busy_s;
  std::vector<PointOutcome> outcomes;
  IntervalSet left_out{};  ///< points of the lease that a filter leaves out
};
/// The results of a StoreResults or StoreFailure effect are durable.
struct ResultsStored {
  WorkerId worker;  ///< 0 if there is no message to acknowledge
  StudyId study;
  std::uint64_t sequence;
  std::vector<PointOutcome> outcomes;
  IntervalSet left_out{};
};
/// The worker is alive and holds exactly these leases.
struct HeartbeatReceived {
  WorkerId worker;
  std::vector<LeaseId> leases;
};
/// The worker will not finish these batches.
struct BatchesReturned {
  WorkerId worker;
  std::vector<LeaseId> leases;
};
/// The worker has announced its end.
struct WorkerLeft {
  WorkerId worker;
};
/// A message could not be sent to the worker, or the worker has violated the protocol.
struct WorkerUnreachable {
  WorkerId worker;
  std::string reason = "its connection is gone";
  /// leases whose batch was not sent, so that their points are not suspect
  std::vector<LeaseId> unsent{};
};
/// `is_busy` is true while the worker does not read its messages; it then gets no batch. The event
/// does not count as a sign of life.
struct WorkerBusy {
  WorkerId worker;
  bool is_busy;
};
/// `held` is true while the disk accepts no results; no batch is sent then.
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

/// Send the study's recipe to the worker, because a batch that needs it follows.
struct DefineStudy {
  WorkerId worker;
  StudyId study;
};
struct SendBatch {
  WorkerId worker;
  StudyId study;
  std::vector<Interval> points;  ///< in the order in which the worker must solve them
  std::uint32_t attempt;
  LeaseId lease;

  std::uint64_t first_point() const { return points.front().begin; }
  std::uint64_t count() const { return size_of(points); }
};
/// Store these results, then pass ResultsStored to the scheduler. Each Results message causes this
/// effect, even if there is nothing to store, because the acknowledgement must follow all earlier
/// commits.
struct StoreResults {
  WorkerId worker;
  StudyId study;
  std::uint64_t sequence;
  std::vector<std::size_t> accepted;  ///< indices into the event's outcomes
  IntervalSet left_out{};             ///< points that a filter leaves out
};
/// Store the failure of the point, then pass ResultsStored with worker 0 to the scheduler.
struct StoreFailure {
  StudyId study;
  std::uint64_t point;
  std::uint32_t attempt;
  std::string reason;
};
/// The results of the worker's message `sequence` are durable. Acknowledge it.
struct AcknowledgeResults {
  WorkerId worker;
  std::uint64_t sequence;
};
/// Make the worker drop the study.
struct WithdrawStudy {
  WorkerId worker;
  StudyId study;
};
/// Make the worker drop the rest of the batch: its points have answers or are leased to others.
struct ReleaseBatch {
  WorkerId worker;
  LeaseId lease;
};
/// The worker was lost and removed. Disconnect it.
struct DropWorker {
  WorkerId worker;
  std::string reason;
};
/// Every point of the study is now completed.
struct StudyFinished {
  StudyId study;
};

using Effect = std::variant<DefineStudy, SendBatch, StoreResults, StoreFailure, AcknowledgeResults,
                            WithdrawStudy, ReleaseBatch, DropWorker, StudyFinished>;

}  // namespace oblique::server
