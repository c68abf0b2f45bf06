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
  /// Maximum size of unstored results [bytes]. Above it no message of a worker is read. At a
  /// quarter of it, sending batches stops until the size is below an eighth of it.
  std::size_t bytes = limits::kUnstoredBytes;
  /// Maximum number of unstored results, because many small messages use memory too.
  std::size_t writes = limits::kUnstoredWrites;
  /// Maximum number of unstored changes of clients, and maximum size of their recipes [bytes].
  /// Above either limit no change is accepted.
  std::size_t changes = limits::kUnstoredChanges;
  std::size_t bytes_of_changes = limits::kUnstoredBytesOfChanges;
};

/// Pending writes: their size, the callbacks for their outcomes, and whether the database accepts
/// writes. Not thread-safe.
class WriteLedger {
 public:
  using OnStored = std::function<void(Instant)>;
  using OnRefused = std::function<void(const std::string& error, Instant)>;

  WriteLedger(const LedgerLimits& limits, Ports& ports) : limits_(limits), ports_(ports) {}

  /// Writes a change and calls `on_stored` when it is durable. With `on_refused` a failure is
  /// reported at once, because a client waits. Without `on_refused` the write is repeated until it
  /// succeeds.
  void write(Change change, OnStored on_stored = {}, OnRefused on_refused = {});
  /// Handles the outcome of a write, which was stored if `error` is empty. Ignores unknown tickets.
  void end(std::uint64_t ticket, const std::optional<std::string>& error, Instant now);
  /// Refuses all pending writes, in order, because the database is gone.
  void abandon(const std::string& error, Instant now);

  /// Sets the reason why the database accepts no changes; an empty text if it accepts changes.
  void set_fault(const std::string& error) { fault_ = error; }

  /// Must be called several times a second.
  void tick(std::int64_t now_ms);
  /// Returns whether nothing was stored for `kSlowAfter_s` although the database has no fault.
  bool is_slow() const { return is_slow_ && fault_.empty(); }
  static constexpr std::int64_t kSlowAfter_s = 5;

  /// Returns why the database accepts no changes, or an empty text.
  const std::string& fault() const { return fault_; }
  /// Returns whether the database file is gone, so that nothing more can be stored.
  bool is_gone() const { return is_gone_; }
  bool is_empty() const { return writes_.empty(); }
  /// Returns the size of pending results [bytes].
  std::size_t bytes() const { return results_.bytes; }

  /// Returns whether no batch should be sent, because the database accepts nothing or is too slow.
  bool holds_batches() const { return !fault_.empty() || is_behind_; }
  /// Returns whether further messages of workers should be read.
  bool has_room() const {
    return results_.bytes < limits_.bytes && results_.writes < limits_.writes;
  }
  /// Returns whether further changes of clients should be accepted.
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
  /// Returns the sum in which the write is counted: `changes_` or `results_`.
  Load& load_of(const Write& write) { return write.on_refused ? changes_ : results_; }
  void weigh();

  LedgerLimits limits_;
  Ports& ports_;
  std::map<std::uint64_t, Write> writes_;  // by ticket
  std::uint64_t last_ticket_ = 0;
  Load results_;  // results, and all other writes for which no client waits
  Load changes_;  // changes requested by clients
  bool is_behind_ = false;
  std::string fault_;
  bool is_gone_ = false;
  std::uint64_t oldest_ = 0;  // oldest pending ticket at the last tick; 0 if none was pending
  std::int64_t oldest_since_ms_ = 0;
  bool is_slow_ = false;
};

}  // namespace oblique::server
