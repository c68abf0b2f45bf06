#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frames.h"
#include "proto/oblique.pb.h"
#include "server/scheduler/scheduler_events.h"
#include "server/service/ports.h"
#include "server/service/study_states.h"
#include "server/service/write_ledger.h"
#include "server/store/changes.h"

namespace oblique::server {

struct WorkerSessionSettings {
  std::uint32_t heartbeat_interval_ms = 900;
  std::string solver_version;  ///< workers with another version are refused
  std::string database_id;
  std::uint64_t last_worker_id = 0;  ///< highest worker number in the database
};

/// A connected worker, from its WorkerHello.
struct WorkerRecord {
  std::string identity;
  AddWorker row;                  ///< row of `workers`, stored with the worker's first result
  std::string key;                ///< name of the worker's key; empty without keys
  std::string host;               ///< name of the worker's machine
  std::int64_t last_sent_ms = 0;  ///< time of the last message to the worker, rounded up to a tick
  bool was_sent = false;          ///< true if a message was sent since the last tick
  bool is_busy = false;           ///< `is_busy` of the worker's last WorkerBusy event
  bool has_row = false;           ///< true if the database has a row for the worker
};

/// The content of a worker's frame.
struct WorkerInput {
  std::vector<Event> events;  ///< events for the scheduler, in order
  protocol::Results results;  ///< message that a ResultsReceived in `events` describes
  WorkerId trace_of = 0;      ///< worker that sent `trace`; 0 if there is no trace
  protocol::Trace trace;
};

/// Sessions of connected workers: turns their messages into events, and effects into messages.
/// Refuses messages that correct workers never send. Frames may be malicious. Not thread-safe.
class WorkerSessions {
 public:
  /// `lost_after_ms` must equal `lost_after_ms` of the scheduler.
  WorkerSessions(WorkerSessionSettings settings, std::int64_t lost_after_ms, Ports& ports,
                 PeerLog& log, const WriteLedger& ledger)
      : settings_(std::move(settings)),
        lost_after_ms_(lost_after_ms),
        ports_(ports),
        log_(log),
        ledger_(ledger) {}

  /// `key` is the name of the worker's key; empty without keys.
  WorkerInput frame(const std::string& identity, std::string_view frame, Instant now,
                    const std::string& key = {});

  // Send messages to workers. Workers that have disconnected are ignored.
  void send(const SendBatch& batch);
  void send(const AcknowledgeResults& stored);
  void send(const WithdrawStudy& withdraw);
  void send(const ReleaseBatch& release);
  /// `lease` is the lease of the batch in the message; 0 if the message has no batch.
  void send(WorkerId worker, const protocol::ServerToWorker& message, LeaseId lease = 0) {
    send_frame(worker, protocol::encode(message), lease);
  }
  /// Sends the stored bytes of the recipe, because encoding a long recipe for each worker is slow.
  void define(const DefineStudy& define, const StudyRecord& study);
  void notify_all(const std::string& text);
  /// Notifies all workers that the server stops, and also workers that join later.
  void stop();

  void drop(const DropWorker& drop);

  /// Returns the time since a worker's last message [ms].
  using Silence = std::function<std::int64_t(WorkerId)>;
  /// Sends a HeartbeatReply to each worker that has sent nothing, or was sent nothing, for 1.25
  /// heartbeat intervals. Must be called several times a second.
  void tick(const Silence& silent_ms, Instant now);
  /// Returns the WorkerUnreachable and WorkerBusy events that occurred while messages were sent.
  std::vector<Event> take_events();

  /// Returns null for an unknown worker.
  WorkerRecord* find(WorkerId worker);
  const std::map<WorkerId, WorkerRecord>& all() const { return workers_; }

 private:
  void hello(const std::string& identity, const protocol::WorkerHello& hello, Instant now,
             const std::string& key, WorkerInput& input);
  std::string refusal_reason(const protocol::WorkerHello& hello) const;
  void results(WorkerId worker, protocol::Results results, WorkerInput& input);
  void disconnect(WorkerId worker, const std::string& why, WorkerInput& input);
  void send_stopping(WorkerId worker);
  void forget(WorkerId worker);
  void send_frame(WorkerId worker, const std::string& frame, LeaseId lease = 0);

  WorkerSessionSettings settings_;
  std::int64_t lost_after_ms_;
  Ports& ports_;
  PeerLog& log_;
  const WriteLedger& ledger_;
  std::map<WorkerId, WorkerRecord> workers_;
  std::map<std::string, WorkerId, std::less<>> ids_;  // by identity
  std::map<WorkerId, WorkerUnreachable> unreachable_;
  std::vector<Event> events_;
  bool stopping_ = false;
};

}  // namespace oblique::server
