#include "server/service/write_ledger.h"

#include <utility>

namespace oblique::server {
namespace {

/// So many workers that each keep as much as they may are too much for the disk together.
constexpr std::size_t kWorkersThatKeepAll = 100;

/// Whether a client waits for a yes or no.
bool is_change_of(const ResultsWrite&) {
  return false;
}
bool is_change_of(const StudyWrite&) {
  return true;
}
bool is_change_of(const StateWrite&) {
  return true;
}
bool is_change_of(const PriorityWrite&) {
  return true;
}
bool is_change_of(const FailuresWrite&) {
  return true;
}
bool is_change_of(const GrowthWrite&) {
  return true;
}
bool is_change_of(const NameWrite&) {
  return true;
}
bool is_change_of(const RemovalWrite&) {
  return true;
}
bool is_change_of(const ReuseWrite&) {
  return false;
}
bool is_change_of(const EndTakingWrite&) {
  return false;
}
bool is_change_of(const QuietWrite&) {
  return false;
}

bool is_change(const Meaning& meaning) {
  return std::visit([](const auto& write) { return is_change_of(write); }, meaning);
}

}  // namespace

void WriteLedger::write(Change change, Meaning meaning) {
  const std::uint64_t ticket = ++last_ticket_;
  // A study can do without reuse, so that a lookup that fails delays nothing else.
  const bool answer_failure = is_change(meaning) || std::holds_alternative<ReuseWrite>(meaning);
  count(meaning);
  open_.emplace(ticket, std::move(meaning));
  weigh();
  writer_.write({ticket, std::move(change), answer_failure});
}

std::optional<Meaning> WriteLedger::settle(std::uint64_t ticket) {
  const auto found = open_.find(ticket);
  if (found == open_.end()) {
    return std::nullopt;
  }
  Meaning meaning = std::move(found->second);
  open_.erase(found);
  discount(meaning);
  weigh();
  return meaning;
}

void WriteLedger::tick(std::int64_t now_ms) {
  constexpr std::int64_t kMillisecondsASecond = 1000;
  const std::uint64_t oldest = open_.empty() ? 0 : open_.begin()->first;
  if (std::exchange(oldest_, oldest) != oldest || oldest == 0) {
    oldest_since_ms_ = now_ms;
  }
  is_slow_ = now_ms - oldest_since_ms_ >= kSlowAfter_s * kMillisecondsASecond;
}

std::vector<Meaning> WriteLedger::abandon(const std::string& error) {
  fault_ = error;
  is_gone_ = true;
  std::vector<Meaning> given_up;
  for (auto& [ticket, meaning] : open_) {
    discount(meaning);
    given_up.push_back(std::move(meaning));
  }
  open_.clear();
  return given_up;
}

bool WriteLedger::has_room_for(WorkerId worker) const {
  const auto own = of_workers_.find(worker);
  return bytes_ < limits_.bytes &&
         (own == of_workers_.end() || own->second.bytes < limits_.bytes_of_worker);
}

bool WriteLedger::is_flooded_by(WorkerId worker) const {
  const auto own = of_workers_.find(worker);
  return (own != of_workers_.end() && own->second.messages >= limits_.most_messages_of_worker) ||
         open_.size() >= kWorkersThatKeepAll * limits_.most_messages_of_worker;
}

bool WriteLedger::takes_no_worker() const {
  return is_gone_ || open_.size() >= limits_.most_messages_of_worker;
}

void WriteLedger::count(const Meaning& meaning) {
  changes_ += is_change(meaning) ? 1U : 0U;
  if (const auto* results = std::get_if<ResultsWrite>(&meaning)) {
    Unstored& own = of_workers_[results->event.worker];
    ++own.messages;
    own.bytes += results->bytes;
    bytes_ += results->bytes;
  }
}

void WriteLedger::discount(const Meaning& meaning) {
  changes_ -= is_change(meaning) ? 1U : 0U;
  if (const auto* results = std::get_if<ResultsWrite>(&meaning)) {
    const auto own = of_workers_.find(results->event.worker);
    own->second.bytes -= results->bytes;
    bytes_ -= results->bytes;
    if (--own->second.messages == 0) {
      of_workers_.erase(own);
    }
  }
}

void WriteLedger::weigh() {
  const std::size_t parts = is_behind_ ? 2 : 1;
  is_behind_ =
      bytes_ >= limits_.bytes_to_hold / parts || open_.size() >= limits_.messages_to_hold / parts;
}

}  // namespace oblique::server
