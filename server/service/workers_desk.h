#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"
#include "server/scheduler/scheduler_events.h"
#include "server/service/outbox/log_limits.h"
#include "server/service/outbox/outbox.h"
#include "server/service/write_ledger.h"

namespace oblique::server {

struct WorkersDeskSettings {
  std::uint32_t heartbeat_interval_ms = 900;
  std::int64_t lost_after_ms = 2800;  ///< the scheduler's
  std::string solver_version;         ///< workers with another one are told so
  std::string database_id;
  std::uint64_t last_worker_id = 0;  ///< in the database
  bool is_insecure = false;          ///< workers are told that anybody may come
};

/// A worker on its one connection, as it describes itself.
struct WorkerRecord {
  std::string identity;
  std::string name;
  std::uint32_t threads;
  std::string solver_version;
  std::string instruction_set;
  std::string joined_at;
  std::uint32_t hellos = 1;
  std::string key{};         ///< its name; empty: without keys
  std::int64_t told_ms = 0;  ///< when it was sent something, to a tick
  bool was_told = false;     ///< since the last tick
  bool is_busy = false;      ///< as the scheduler knows
  bool has_row = false;      ///< in the database, since its first result
  std::string host{};        ///< its machine; as its name says, if it does not
};

/// What a frame of a worker comes to.
struct Heard {
  std::vector<Event> events;  ///< for the scheduler, in order
  protocol::Results results;  ///< that a ResultsReceived among them tells of
  WorkerId trace_of = 0;      ///< worker that sent a trace; 0: none did
  protocol::Trace trace;
};

/// Speaks with workers: makes the scheduler's events of their messages, and messages of what the
/// scheduler wants of them. Refuses what no sound worker sends. Every frame is taken for hostile
/// until it is parsed. It knows who they are, not what they do. Not thread-safe.
class WorkersDesk {
 public:
  WorkersDesk(WorkersDeskSettings settings, ToWorkers& network, ToLog& log, BadFrames& bad_frames,
              const WriteLedger& ledger);

  /// `key`: name of the worker's; empty without keys.
  Heard take(const std::string& identity, std::string_view frame, Instant now,
             const std::string& key = {});

  // To workers that are known; others are passed over.
  void send(const SendBatch& batch);
  void send(const SendProbe& probe);
  void send(const AcknowledgeResults& stored);
  void send(const WithdrawStudy& withdraw);
  void send(const ReleaseBatch& release);
  void send(WorkerId worker, const protocol::ServerToWorker& message, LeaseId lease = 0);
  /// The recipe goes out as it is kept: encoding a long one again for each worker would hold up the
  /// others.
  void define(const DefineStudy& define, const std::string& recipe_bytes);
  void notice(const std::string& text);

  /// The worker is unknown from now on.
  void drop(const DropWorker& drop, Instant now);
  /// Says that the server stops, to all and to those that join from now on.
  void stop();

  /// For how long the worker has been silent, in ms.
  using Silence = std::function<std::int64_t(WorkerId)>;
  /// Sends signs of life to those whose heartbeat is late, which shows whether they are there, and
  /// to those who have heard nothing for as long, for what they sent may wait for the disk; and
  /// looks who has begun to read again. To be called several times a second.
  void tick(const Silence& silent_ms, Instant now);
  /// What was found out about workers while messages went out: who is gone, who is busy.
  std::vector<Event> take_found();

  /// Null for an unknown worker.
  const WorkerRecord* find(WorkerId worker) const;
  std::optional<WorkerId> find(std::string_view identity) const;
  /// The worker of the lowest number above this one.
  std::optional<WorkerId> next_after(WorkerId worker) const;
  /// Its first result is stored with its row: true the first time that this is asked.
  bool needs_row(WorkerId worker);

 private:
  void hello(const std::string& identity, const protocol::WorkerHello& hello, Instant now,
             const std::string& key, Heard& heard);
  bool refuse(const std::string& identity, const protocol::WorkerHello& hello);
  bool welcome(WorkerId id, const WorkerRecord& worker);
  void results(WorkerId worker, protocol::Results results, Heard& heard);
  void oversized(const std::string& identity, Heard& heard);
  void give_up(WorkerId worker, const std::string& why, Heard& heard);
  void tell_of_version(WorkerId worker, Instant now);
  void notice_to(WorkerId worker, const std::string& text);
  void forget(WorkerId worker);
  /// `lease`: of the batch that the message is; 0: it is none.
  void note_delivery(WorkerId worker, WorkerRecord& record, Delivery delivery);
  void note(Severity severity, const std::string& text, Instant now);

  WorkersDeskSettings settings_;
  ToWorkers& network_;
  ToLog& log_;
  BadFrames& bad_frames_;
  const WriteLedger& ledger_;
  std::map<WorkerId, WorkerRecord> workers_;
  std::map<std::string, WorkerId, std::less<>> ids_;  // by identity
  std::map<WorkerId, WorkerUnreachable> gone_;        // found out while messages went out
  std::vector<Event> found_;                          // the rest of what was
  NoteRate notes_;
  std::uint64_t refused_ = 0;
  bool stopping_ = false;
};

}  // namespace oblique::server
