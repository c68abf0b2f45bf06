#include "server/service/write_ledger.h"

#include <utility>

namespace oblique::server {

void WriteLedger::write(Change change, OnStored on_stored, OnRefused on_refused) {
  const std::uint64_t ticket = ++last_ticket_;
  const bool can_be_refused = on_refused != nullptr;
  const Write write{std::move(on_stored), std::move(on_refused), bytes_of(change)};
  load_of(write).bytes += write.bytes;
  ++load_of(write).writes;
  writes_.emplace(ticket, write);
  weigh();
  ports_.write({ticket, std::move(change), can_be_refused});
}

void WriteLedger::end(std::uint64_t ticket, const std::optional<std::string>& error, Instant now) {
  const auto found = writes_.extract(ticket);
  if (!found) {
    return;
  }
  const Write& write = found.mapped();
  load_of(write).bytes -= write.bytes;
  --load_of(write).writes;
  weigh();
  if (error && write.on_refused) {
    write.on_refused(*error, now);
  } else if (!error && write.on_stored) {
    write.on_stored(now);
  }
}

void WriteLedger::abandon(const std::string& error, Instant now) {
  fault_ = error;
  is_gone_ = true;
  while (!writes_.empty()) {  // handling a refusal may add further writes
    end(writes_.begin()->first, error, now);
  }
}

void WriteLedger::tick(std::int64_t now_ms) {
  const std::uint64_t oldest = writes_.empty() ? 0 : writes_.begin()->first;
  if (std::exchange(oldest_, oldest) != oldest || oldest == 0) {
    oldest_since_ms_ = now_ms;
  }
  is_slow_ = now_ms - oldest_since_ms_ >= 1000 * kSlowAfter_s;
}

void WriteLedger::weigh() {
  const std::size_t part = is_behind_ ? 8 : 4;
  is_behind_ = results_.bytes >= limits_.bytes / part || results_.writes >= limits_.writes / part;
}

}  // namespace oblique::server
