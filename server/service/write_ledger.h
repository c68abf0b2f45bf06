#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "server/scheduler/scheduler_events.h"
#include "server/service/outbox/outbox.h"
#include "server/study/limits.h"

namespace oblique::server {

// What a write stands for: what follows when it is durable, or refused.

/// Results of one message, or a point that the server failed itself.
struct ResultsWrite {
  ResultsStored event;
  std::uint32_t attempt;
  std::size_t bytes;  ///< of the worker's message; 0: of none
};
struct StudyWrite {
  StudyId study;
  bool reuses = false;  ///< results of other studies are to be looked up
};
struct StateWrite {
  StudyId study;
  StudyState state;
  Client client;
  bool submitted;  ///< the client asked for it by submitting the study again
};
struct PriorityWrite {
  StudyId study;
  std::int32_t priority = 0;
  Client client;  ///< submitted the study again
};
struct FailuresWrite {
  StudyId study;
  IntervalSet points;  ///< whose failures are forgotten
  Client client;
};
/// The study has all the points of the table.
struct GrowthWrite {
  StudyId study;
  StudyTable table;
  std::int32_t priority = 0;
  std::uint64_t points_before;
  StudyState state_before;
  bool reuses = false;  ///< as in StudyWrite
};
struct NameWrite {
  StudyId study;
  std::string name;  ///< the new one
  Client client;
};
struct RemovalWrite {
  StudyId study;
  Client client;
};
/// Rows that were copied from other studies.
struct ReuseWrite {
  StudyId study;
  std::shared_ptr<const ReusedResults> outcome;
};
struct EndReuseWrite {
  StudyId study;
};
/// Nothing follows.
struct QuietWrite {};

using Meaning =
    std::variant<ResultsWrite, StudyWrite, StateWrite, PriorityWrite, FailuresWrite, GrowthWrite,
                 NameWrite, RemovalWrite, ReuseWrite, EndReuseWrite, QuietWrite>;

struct LedgerLimits {
  /// Results messages of one worker that wait for the disk. A sound worker stops long before.
  std::size_t most_messages_of_worker = limits::kUnstoredMessagesOfWorker;
  /// Results that wait for the disk, as bytes of their messages. With so many of one worker, or of
  /// all, no more are taken: they wait where they are.
  std::size_t bytes_of_worker = limits::kUnstoredBytesOfWorker;
  std::size_t bytes = limits::kUnstoredBytes;
  /// With so many no batch goes out, until half of them are stored.
  std::size_t bytes_to_hold = limits::kUnstoredBytesToHold;
  std::size_t messages_to_hold = limits::kUnstoredMessagesToHold;
  std::size_t most_changes = limits::kUnstoredChanges;  ///< of clients
};

/// The writes that were handed to the writer and are not known to be durable or refused: what each
/// stands for, how much they are, of whom, and whether the database takes any. Who hands something
/// over acknowledges it only when `settle` gave it back. Not thread-safe.
class WriteLedger {
 public:
  WriteLedger(const LedgerLimits& limits, ToWriter& writer) : limits_(limits), writer_(writer) {}

  /// Hands the change over. Where a client waits for a yes or no, a failure is reported at once;
  /// else the change is tried until it is durable.
  void write(Change change, Meaning meaning);
  /// What the write of that ticket stands for, which is known to be durable or refused now. Nothing
  /// for a ticket that is not open.
  std::optional<Meaning> settle(std::uint64_t ticket);
  /// The database is gone, as `error` says: all that is open, in order, none of which will be
  /// durable.
  std::vector<Meaning> abandon(const std::string& error);

  /// The database takes no results, as `error` says, or takes them again.
  void note_fault(const std::string& error) { fault_ = error; }
  void note_recovery() { fault_.clear(); }

  /// To be called several times a second.
  void tick(std::int64_t now_ms);
  /// Nothing became durable for `kSlowAfter_s`, and the database does not say why.
  bool is_slow() const { return is_slow_ && fault_.empty(); }
  static constexpr std::int64_t kSlowAfter_s = 5;

  /// Why the database takes no results; empty: it does.
  const std::string& fault() const { return fault_; }
  /// The database is not where it was; nothing can be stored any more.
  bool is_gone() const { return is_gone_; }
  bool is_empty() const { return open_.empty(); }
  /// So much is not durable yet, and so many bytes of it are messages with results.
  std::size_t jobs() const { return open_.size(); }
  std::size_t bytes() const { return bytes_; }

  /// No batch should go out: the database takes nothing, or is far behind.
  bool holds_batches() const { return !fault_.empty() || is_behind_; }
  /// Whether results of that worker should be taken now, or wait until more is stored.
  bool has_room_for(WorkerId worker) const;
  /// The worker has sent more than sound workers keep, or all together have.
  bool is_flooded_by(WorkerId worker) const;
  /// So much waits that no further worker should be taken on.
  bool takes_no_worker() const;
  /// So many changes of clients wait that no further one should be taken.
  bool takes_no_change() const { return changes_ >= limits_.most_changes; }

 private:
  struct Unstored {
    std::size_t messages = 0;
    std::size_t bytes = 0;
  };
  void count(const Meaning& meaning);
  void discount(const Meaning& meaning);
  void weigh();

  LedgerLimits limits_;
  ToWriter& writer_;
  std::map<std::uint64_t, Meaning> open_;  // by ticket
  std::uint64_t last_ticket_ = 0;
  std::map<WorkerId, Unstored> of_workers_;
  std::size_t bytes_ = 0;    // of all workers' results
  std::size_t changes_ = 0;  // that a client waits for
  bool is_behind_ = false;
  std::string fault_;
  bool is_gone_ = false;
  std::uint64_t oldest_ = 0;  // ticket at the last tick; 0: none
  std::int64_t oldest_since_ms_ = 0;
  bool is_slow_ = false;
};

}  // namespace oblique::server
