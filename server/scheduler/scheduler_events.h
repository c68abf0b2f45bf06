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

// Events that the scheduler handles, and effects that it returns.
namespace oblique::server {

using LeaseId = std::uint64_t;

struct SchedulerSettings {
  /// A worker is lost after this silence: three missed heartbeats, noticed within 3 s.
  std::int64_t lost_after_ms = 2800;
  double batch_target_s = 0.1;           ///< target duration of a batch at a worker's known pace
  std::uint64_t first_batch_points = 4;  ///< per thread, while a worker's pace is unknown
  std::uint64_t largest_batch_points = 4096;  ///< per thread
  /// Number of points, or falls of models, that a thread solves side by side in nearly the time of
  /// one. A batch has at least this number per thread,
  std::uint64_t lanes = 8;
  double lanes_batch_s = 10.0;  ///< unless its points would take longer than this
  double models_batch_s = 1.0;  ///< or its models longer than this.
  std::uint64_t growth = 4;     ///< largest growth factor from one batch of a worker to the next
  /// Number of further batches left for each thread while free points last. So batches shrink
  /// toward the end of a study and all workers finish together.
  std::uint64_t tail_batches_per_thread = 3;
  double shortest_batch_s = 0.01;  ///< for shorter batches transport would cost more than they gain
  /// Without other points to lease, a batch that takes this long, and `straggler_factor` times as
  /// long as expected, is also given to a second worker. Not batches that lost a worker.
  std::int64_t straggler_after_ms = 1000;
  double straggler_factor = 4.0;
  LossLimits loss_limits{};
  std::uint64_t suspect_parts = 8;  ///< number of parts into which a suspect interval is split
  /// A failing point fails after this time unless a process that was lost with it returns.
  std::int64_t return_within_ms = 10'000;
  /// A risky point is reserved for the longest proven worker for this time.
  std::int64_t longest_proven_within_ms = 10'000;
  /// A process is set aside after this number of losses in a row, until it has solved a probe.
  std::uint32_t set_aside_after = 3;
  /// Every new process is set aside while this number of new processes were lost with points within
  /// `newcomers_watched_ms`.
  std::size_t vanished_newcomers = 3;
  std::int64_t newcomers_watched_ms = 60'000;
  std::int64_t probe_interval_ms = 1000;  ///< time between two probes of one worker
  /// A worker holds at most this number of batches more than it has solved since it joined or
  /// stalled.
  std::size_t newcomer_batches = 2;
  /// A worker has stalled if it stores nothing for this multiple of the expected duration of its
  /// longest batch, within the limits below; its batches go to others.
  double stall_factor = 10.0;
  std::int64_t shortest_stall_ms = 60'000;
  std::int64_t longest_stall_ms = 3'600'000;
  std::size_t most_absent_processes = 4096;    ///< absent processes that are kept
  std::uint32_t max_credit = limits::kCredit;  ///< batches
  /// Points per thread in a batch of a filtered study before the worker has solved one, because the
  /// filter may include all of them.
  std::uint64_t unsolved_batch_points = 256;
  /// First lease number. A restarted server starts above all earlier ones, so that results of an
  /// earlier run never end a lease of this one.
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
/// A held study gets no leases, whatever its state.
struct StudyHeld {
  StudyId study;
  bool held;
};
/// Rows of these points, copied from other studies, are durable.
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
/// Further points of the study are durable, and it runs.
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
  std::string process{};  ///< its earlier connection has ended; empty: unknown
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
/// The worker is alive and holds these leases.
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
/// A message could not be sent to the worker, or the worker violates the protocol.
struct WorkerUnreachable {
  WorkerId worker;
  std::string reason = "its connection is gone";
  /// leases whose batch was not sent, so their points are not suspect
  std::vector<LeaseId> unsent{};
};
/// A busy worker does not read its messages and gets no batch. Does not count as a sign of life.
struct WorkerBusy {
  WorkerId worker;
  bool is_busy;
};
/// While held, because the disk does not accept results, no batch is sent.
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

/// Send the recipe, because a batch of the study or of its new points follows.
struct DefineStudy {
  WorkerId worker;
  StudyId study;
};
struct SendBatch {
  WorkerId worker;
  StudyId study;
  std::vector<Interval> points;  ///< in the order in which to solve them
  std::uint32_t attempt;
  LeaseId lease;

  std::uint64_t first_point() const { return points.front().begin; }
  std::uint64_t count() const { return size_of(points); }
};
/// Store these results, then feed ResultsStored. One for each Results message, even if there is
/// nothing to store, because its acknowledgement follows all earlier commits.
struct StoreResults {
  WorkerId worker;
  StudyId study;
  std::uint64_t sequence;
  std::vector<std::size_t> accepted;  ///< indices into the event's outcomes
  IntervalSet left_out{};             ///< points that a filter leaves out
};
/// Store the failure of the point, then feed ResultsStored (worker 0).
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
/// Send an easy point of kProbeStudy. Its result is not stored.
struct SendProbe {
  WorkerId worker;
  LeaseId lease;
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
/// The worker was lost and removed.
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
