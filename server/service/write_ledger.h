#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "server/scheduler/scheduler_events.h"
#include "server/service/ports.h"
#include "server/study/limits.h"

namespace oblique::server {

struct LedgerLimits {
  /// Bytes of results that wait for the disk. Above it no message of a worker is read; above a
  /// quarter no batch is sent, until half of that is stored.
  std::size_t bytes = limits::kUnstoredBytes;
  /// The same for their number, so that small messages are bounded, too.
  std::size_t writes = limits::kUnstoredWrites;
  /// Changes of clients, and bytes of their recipes. Above it no change is accepted.
  std::size_t changes = limits::kUnstoredChanges;
  std::size_t bytes_of_changes = limits::kUnstoredBytesOfChanges;
};

/// The writes whose outcome is not known yet: what follows from each, their size, and whether the
/// database accepts any. Not thread-safe.
class WriteLedger {
 public:
  using OnStored = std::function<void(Instant)>;
  using OnRefused = std::function<void(const std::string& error, Instant)>;

  WriteLedger(const LedgerLimits& limits, Ports& ports) : limits_(limits), ports_(ports) {}

  /// Writes a change and calls `on_stored` when it is durable. With `on_refused` a failure is
  /// reported at once, because a client waits; without it the change is tried until it is durable.
  void write(Change change, OnStored on_stored = {}, OnRefused on_refused = {});
  /// The outcome of a write, which was stored without an `error`. Unknown tickets are ignored.
  void end(std::uint64_t ticket, const std::optional<std::string>& error, Instant now);
  /// The database is gone: refuses all writes, in order.
  void abandon(const std::string& error, Instant now);

  /// The database accepts no changes, as `error` says; empty: it does again.
  void set_fault(const std::string& error) { fault_ = error; }

  /// To be called several times a second.
  void tick(std::int64_t now_ms);
  /// Nothing was stored for `kSlowAfter_s`, and the database has not reported why.
  bool is_slow() const { return is_slow_ && fault_.empty(); }
  static constexpr std::int64_t kSlowAfter_s = 5;

  /// Why the database accepts no changes; empty: it does.
  const std::string& fault() const { return fault_; }
  /// The file is gone; nothing more can be stored.
  bool is_gone() const { return is_gone_; }
  bool is_empty() const { return writes_.empty(); }
  /// Of results.
  std::size_t bytes() const { return results_.bytes; }

  /// No batch should be sent: the database accepts nothing, or is far behind.
  bool holds_batches() const { return !fault_.empty() || is_behind_; }
  /// Whether further messages of workers should be taken.
  bool has_room() const {
    return results_.bytes < limits_.bytes && results_.writes < limits_.writes;
  }
  /// Whether further changes of clients should be accepted.
  bool has_room_for_changes() const {
    return changes_.bytes < limits_.bytes_of_changes && changes_.writes < limits_.changes;
  }

 private:
  struct Write {
    OnStored on_stored;
    OnRefused on_refused;
    std::size_t bytes;
  };
  struct Load {
    std::size_t writes = 0;
    std::size_t bytes = 0;
  };
  /// Of the kind of that write.
  Load& load_of(const Write& write) { return write.on_refused ? changes_ : results_; }
  void weigh();

  LedgerLimits limits_;
  Ports& ports_;
  std::map<std::uint64_t, Write> writes_;  // by ticket
  std::uint64_t last_ticket_ = 0;
  Load results_;  // and all else that no client waits for
  Load changes_;  // of clients
  bool is_behind_ = false;
  std::string fault_;
  bool is_gone_ = false;
  std::uint64_t oldest_ = 0;  // ticket at the last tick; 0: none
  std::int64_t oldest_since_ms_ = 0;
  bool is_slow_ = false;
};

}  // namespace oblique::server
