#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"
#include "server/scheduler/scheduler.h"
#include "server/service/client_handler.h"
#include "server/service/ports.h"
#include "server/service/status.h"
#include "server/service/study_changes.h"
#include "server/service/study_states.h"
#include "server/service/worker_sessions.h"
#include "server/service/write_ledger.h"
#include "server/store/store.h"

namespace oblique::server {

struct ServiceSettings : WorkerSessionSettings {
  SchedulerSettings scheduler;
  LedgerLimits ledger;
  ClientHandlerSettings clients;
  StudyBounds bounds;
  std::uint64_t last_study_id = 0;
  /// Only points of this study are leased. If empty, points of all studies are leased.
  std::string only_study{};
};

/// Number of points that were stored since the service started.
struct StoredPoints {
  std::uint64_t solved = 0;
  std::uint64_t failed = 0;
  std::uint64_t ignored = 0;  ///< not stored, because they were for another study
};

/// Dispatcher between message handlers, scheduler and writer. It has no sockets, clock or thread,
/// so tests drive it message by message. Not thread-safe.
class Service {
 public:
  /// `ports` must outlive the service. `studies` were read from the database.
  Service(const ServiceSettings& settings, Ports& ports, std::vector<StoredStudy> studies,
          Instant now);
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;

  /// `holder` is the peer's key; null without keys.
  void worker_frame(const std::string& identity, std::string_view frame, Instant now,
                    const std::shared_ptr<const KeyIdentity>& holder = nullptr);
  void client_frame(const std::string& identity, std::string_view frame, Instant now,
                    const std::shared_ptr<const KeyIdentity>& holder = nullptr) {
    clients_.frame(identity, frame, now, holder);
  }
  /// Handles a client's disconnection.
  void client_left(std::string_view identity) { clients_.client_left(identity); }
  /// Logs a line about a peer that is not admitted; at most 20 such lines in 10 s.
  void log_stranger(const std::string& text) { peer_log_.write_of_stranger(text); }
  void written(const WriteReport& report, Instant now);
  void query_report(QueryReport report) { clients_.query_report(std::move(report)); }
  /// Must be called several times a second.
  void tick(Instant now);
  /// Stops sending batches and accepting studies; results are still stored.
  void drain(Instant now);
  /// Returns whether no batch is leased and no write is pending.
  bool is_drained() const { return scheduler_.leases() == 0 && ledger_.is_empty(); }
  /// Notifies workers and clients that the server stops. Results are still stored.
  void stop(Instant now);

  /// Returns whether messages of workers should be read now. If not, no worker counts as silent.
  bool has_room() const { return ledger_.has_room(); }
  /// Returns whether nothing more can be stored, so that the server should end.
  bool storage_is_gone() const { return ledger_.is_gone(); }
  bool is_stopping() const { return stopping_ || draining_; }

  const Scheduler& scheduler() const { return scheduler_; }
  const StudyStates& states() const { return states_; }
  const WriteLedger& ledger() const { return ledger_; }
  const PointRates& rates() const { return rates_; }  ///< rates of studies
  QueryCounts query_counts() const { return clients_.query_counts(); }
  const StoredPoints& stored_points() const { return stored_points_; }
  std::uint64_t bad_frames() const { return peer_log_.bad_frames(); }
  const Core& core() const { return core_; }
  std::vector<protocol::WorkerStatus> worker_statuses(std::size_t most, Instant now) const;

 private:
  /// Passes an event to the scheduler, carries out the effects, and repeats this for events they
  /// cause.
  void feed(const Event& event, Instant now);
  /// `results` is the message from which a ResultsReceived was made.
  void handle(const Event& event, Instant now, protocol::Results* results = nullptr);
  void handle_worker_events(Instant now);
  void check_inputs(ResultsReceived& event, protocol::Results& message);
  void hold_or_release_batches(Instant now);
  void store(const StoreResults& effect, protocol::Results* message, Instant now);
  void store(const StoreFailure& effect, Instant now);
  void write_results(AddResults change, ResultsStored event);
  void results_stored(const ResultsStored& event, Instant now);
  void restore(StoredStudy study, const std::string& only_study, Instant now);

  Ports& ports_;
  Scheduler scheduler_;
  WriteLedger ledger_;
  StudyStates states_;
  PointRates rates_;
  PointRates worker_rates_;
  PeerLog peer_log_;
  WorkerSessions workers_;
  Core core_;
  StudyChanges changes_;
  ClientHandler clients_;
  StoredPoints stored_points_;
  bool stopping_ = false;
  bool draining_ = false;
  bool holds_batches_ = false;  // value of the last DispatchHeld event
};

}  // namespace oblique::server
