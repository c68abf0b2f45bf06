#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "server/service/ports/ports.h"
#include "server/study/limits.h"

namespace oblique::server {

struct LedgerLimits {
  /// Bytes of results and recipes that wait for the disk. Above it no message of a worker is read
  /// and no change of a client accepted; above a quarter no batch is sent, until half of that is
  /// stored.
  std::size_t bytes = limits::kUnstoredBytes;
  /// The same for all writes, so that small messages are bounded, too.
  std::size_t writes = 80'000;
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
  /// The outcome of a write. Unknown tickets are ignored.
  void stored(std::uint64_t ticket, Instant now) { end(ticket, std::nullopt, now); }
  void refused(std::uint64_t ticket, const std::string& error, Instant now) {
    end(ticket, error, now);
  }
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
  std::size_t bytes() const { return bytes_; }

  /// No batch should be sent: the database accepts nothing, or is far behind.
  bool holds_batches() const { return !fault_.empty() || is_behind_; }
  /// Whether further messages of workers and changes of clients should be taken.
  bool has_room() const { return bytes_ < limits_.bytes && writes_.size() < limits_.writes; }

 private:
  struct Write {
    OnStored on_stored;
    OnRefused on_refused;
    std::size_t bytes;
  };
  void end(std::uint64_t ticket, const std::optional<std::string>& error, Instant now);
  void weigh();

  LedgerLimits limits_;
  Ports& ports_;
  std::map<std::uint64_t, Write> writes_;  // by ticket
  std::uint64_t last_ticket_ = 0;
  std::size_t bytes_ = 0;
  bool is_behind_ = false;
  std::string fault_;
  bool is_gone_ = false;
  std::uint64_t oldest_ = 0;  // ticket at the last tick; 0: none
  std::int64_t oldest_since_ms_ = 0;
  bool is_slow_ = false;
};

}  // namespace oblique::server
