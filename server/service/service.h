#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/oblique.pb.h"
#include "server/scheduler/scheduler.h"
#include "server/service/clients_desk.h"
#include "server/service/counts/settled_rates.h"
#include "server/service/counts/study_states.h"
#include "server/service/outbox/log_limits.h"
#include "server/service/outbox/outbox.h"
#include "server/service/study_changes.h"
#include "server/service/traces/trace_handler.h"
#include "server/service/workers_desk.h"
#include "server/service/write_ledger.h"
#include "server/store/store.h"

namespace oblique::server {

struct ServiceSettings {
  SchedulerSettings scheduler;
  LedgerLimits ledger;
  ClientsDeskSettings clients;
  StudyBounds bounds;
  std::uint32_t heartbeat_interval_ms = 900;
  std::string solver_version;  ///< workers with another one are told so
  std::string database_id;
  std::uint64_t last_study_id = 0;
  std::uint64_t last_worker_id = 0;
  /// Points of this study alone are handed out; others of the database wait. Empty: of all.
  std::string only_study{};
};

/// Points that were stored since the service began.
struct StoredPoints {
  std::uint64_t solved = 0;
  std::uint64_t failed = 0;
};

/// What happens between messages: tells the scheduler what the desks hear and what the database
/// took, and carries out what it decides. No sockets, no clock, no thread: tests drive it message
/// by message. README.md draws it. Not thread-safe.
class Service {
 public:
  /// `outbox` must outlive the service. `studies` are those of the database.
  Service(const ServiceSettings& settings, Outbox& outbox, std::vector<StoredStudy> studies,
          Instant now);
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;

  /// `holder`: of the peer's key; null without keys.
  void worker_frame(const std::string& identity, std::string_view frame, Instant now,
                    const std::shared_ptr<const KeyHolder>& holder = nullptr);
  void client_frame(const std::string& identity, std::string_view frame, Instant now,
                    const std::shared_ptr<const KeyHolder>& holder = nullptr);
  void written(const WriteReport& report, Instant now);
  void queried(QueryReport report) { clients_.queried(std::move(report)); }
  void request_read(const ReadReport& report, Instant now) {
    clients_.request_read(report, now);
    send_traces();
  }
  /// The connection of that client is gone.
  void client_left(std::string_view identity) {
    clients_.client_left(identity);
    send_traces();
  }
  /// To be called several times a second.
  void tick(Instant now);
  /// Goes on to look for points that filters leave in, while workers wait for some. True when there
  /// is more to look for at once.
  /// Nothing is handed out and no study taken any more; results are, and all else goes on.
  void drain(Instant now);
  /// Nothing is with workers, or on its way to the disk.
  bool is_drained() const { return scheduler_.leases() == 0 && ledger_.is_empty(); }
  /// Tells the workers that the server stops. Nothing is handed out afterwards; results are still
  /// taken.
  void stop(Instant now);

  /// Whether a message of that worker should be taken now, or wait until more is stored. Who waits
  /// so is not taken for silent.
  bool has_room_for(std::string_view worker) const;
  /// Something is on its way to the disk.
  bool waits_for_disk() const { return !ledger_.is_empty(); }
  /// The database is not where it was: nothing more can be stored, and the server should end.
  bool storage_is_gone() const { return ledger_.is_gone(); }
  /// Frames that no sound peer sends.
  std::uint64_t bad_frames() const { return bad_frames_.total(); }
  const Scheduler& scheduler() const { return scheduler_; }
  const SettledRates& rates() const { return rates_; }
  const StudyStates& states() const { return states_; }
  const WriteLedger& ledger() const { return ledger_; }
  QueryCounts query_counts() const { return clients_.query_counts(); }
  const StoredPoints& stored_points() const { return stored_points_; }
  /// Of all studies, over the last seconds.
  double points_per_s(std::int64_t now_ms) const;
  bool is_stopping() const { return stopping_ || draining_; }
  /// A study that is durable, and the first so many workers, as clients see them.
  StudyView study_view(StudyId id, Instant now) const {
    return view_of(id, {scheduler_, states_, ledger_, rates_, known_}, now);
  }
  std::vector<WorkerView> worker_views(std::size_t most, Instant now) const {
    return first_workers(most, workers_, scheduler_, worker_rates_, now);
  }

 private:
  /// What the events that are fed have in common.
  struct Turn {
    Instant now;
    protocol::Results* results = nullptr;  // of the worker's message
  };

  void feed(const Event& event, Instant now);
  void handle(const Event& event, Turn turn);
  void judge_inputs(ResultsReceived& event, protocol::Results& message) const;
  void handle_found(Instant now);
  void hand_out_or_hold(Instant now);
  void tell_traces(const Event& event);
  void send_traces() {
    for (const auto& [worker, message] : traces_.take_messages()) {
      workers_.send(worker, message);
    }
  }
  std::uint64_t settled_of(StudyId id) const;

  void perform(const DefineStudy& effect, Turn turn);
  void perform(const SendBatch& effect, Turn turn);
  void perform(const SendProbe& effect, Turn turn);
  void perform(const StoreResults& effect, Turn turn);
  void perform(const StoreFailure& effect, Turn turn);
  void perform(const AcknowledgeResults& effect, Turn turn);
  void perform(const WithdrawStudy& effect, Turn turn);
  void perform(const ReleaseBatch& effect, Turn turn);
  void perform(const DropWorker& effect, Turn turn);
  void perform(const StudyFinished& effect, Turn turn);

  void begin_reuse(StudyId id, Instant now);
  void reuse_part(StudyId id, std::uint64_t first_point);

  void lose_storage(const std::string& error, Instant now);
  void stored(const ResultsWrite& write, Instant now);
  void stored(const StudyWrite& write, Instant now);
  void stored(const StateWrite& write, Instant now);
  void stored(const PriorityWrite& write, Instant now);
  void stored(const FailuresWrite& write, Instant now);
  void stored(const GrowthWrite& write, Instant now);
  void stored(const NameWrite& write, Instant now);
  void stored(const RemovalWrite& write, Instant now);
  void stored(const ReuseWrite& write, Instant now);
  void stored(const EndReuseWrite& write, Instant now);
  void stored(const QuietWrite& write, Instant now);
  void refused(const ResultsWrite& write, const std::string& error, Instant now);
  void refused(const StudyWrite& write, const std::string& error, Instant now);
  void refused(const StateWrite& write, const std::string& error, Instant now);
  void refused(const PriorityWrite& write, const std::string& error, Instant now);
  void refused(const FailuresWrite& write, const std::string& error, Instant now);
  void refused(const GrowthWrite& write, const std::string& error, Instant now);
  void refused(const NameWrite& write, const std::string& error, Instant now);
  void refused(const RemovalWrite& write, const std::string& error, Instant now);
  void refused(const ReuseWrite& write, const std::string& error, Instant now);
  void refused(const EndReuseWrite& write, const std::string& error, Instant now);
  void refused(const QuietWrite& write, const std::string& error, Instant now);

  Outbox& outbox_;
  Scheduler scheduler_;
  WriteLedger ledger_;
  StudyStates states_;
  TakeOvers known_;
  SettledRates rates_;
  SettledRates worker_rates_;  // by worker
  BadFrames bad_frames_;
  WorkersDesk workers_;
  OpenStudies open_;
  StudyChanges changes_;
  TraceHandler traces_;
  ClientsDesk clients_;
  StoredPoints stored_points_;
  bool stopping_ = false;
  bool draining_ = false;
  bool holds_batches_ = false;  // as the scheduler knows
};

}  // namespace oblique::server
