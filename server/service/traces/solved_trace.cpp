#include "server/service/traces/solved_trace.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/result_message.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::server {
namespace {

/// Rows of one reply have about so many bytes.
constexpr std::size_t kReplyBytes = std::size_t{1} << 20U;

std::size_t numbers_of(const protocol::ModelParameters& model, bool shape) {
  return solver::trace_numbers(
      solver::trace_shape(static_cast<std::size_t>(model.lengths_m_size()),
                          static_cast<std::size_t>(model.elements_per_link()), shape));
}

}  // namespace

SolvedTrace::SolvedTrace(const TraceKey& key, const TracedPoint& point, std::size_t most_bytes)
    : head_(said_of(point)),
      numbers_a_row_(numbers_of(point.model, key.shape)),
      has_fall_(key.fall),
      most_bytes_(most_bytes) {
  head_.set_study_id(key.study);
}

std::string SolvedTrace::add(const protocol::TraceRows& rows) {
  const std::size_t count = rows.states().size();
  if (static_cast<std::size_t>(rows.values_size()) != count * numbers_a_row_) {
    return fmt::format("its rows have other columns than a trace of this model");
  }
  // One row more than there may be is what the worker finds out, too.
  const std::size_t row_bytes = numbers_a_row_ * sizeof(double) + 1;
  if ((states_.size() + count) * row_bytes > most_bytes_ + 2 * row_bytes) {
    return "it has more rows than a trace may have here";
  }
  const bool are_states = std::all_of(rows.states().begin(), rows.states().end(), [](char code) {
    return static_cast<unsigned char>(code) < solver::kTraceStates.size();
  });
  if (const std::string fault = fault_of_fall(rows.states()); !fault.empty()) {
    return fault;
  }
  const bool are_finite = std::all_of(rows.values().begin(), rows.values().end(),
                                      [](double value) { return std::isfinite(value); });
  if (!are_states || !are_finite) {
    return are_states ? "it has a value that is not finite" : "it has a state that no contact has";
  }
  values_.insert(values_.end(), rows.values().begin(), rows.values().end());
  states_ += rows.states();
  return {};
}

/// Clients that did not ask for the fall do not know its state, and those that did cut it off.
std::string SolvedTrace::fault_of_fall(const std::string& states) const {
  const auto is_falling = [](char code) {
    return static_cast<unsigned char>(code) == solver::kFallingCode;
  };
  const bool falls = std::any_of(states.begin(), states.end(), is_falling);
  const bool has_touched = !states_.empty() && !is_falling(states_.back());
  if (falls && (!has_fall_ || has_touched ||
                !std::is_partitioned(states.begin(), states.end(), is_falling))) {
    return has_fall_ ? "it falls again after the touch" : "it has rows of the fall, unasked";
  }
  return {};
}

std::string SolvedTrace::finish(const protocol::TracePart& last, const std::string& worker,
                                const std::string& solver_version,
                                const std::string& instruction_set) {
  *head_.mutable_result() = last.result();
  head_.set_worker(worker);
  head_.set_solver_version(solver_version);
  head_.set_instruction_set(instruction_set);
  head_.set_outputs(protocol::sent_outputs());
  if (has_failed()) {
    *head_.mutable_result() = protocol::failed_point(0, last.result().error());
    values_.clear();
    states_.clear();
    return {};
  }
  if (const std::string fault = protocol::fault_of(head_.result()); !fault.empty()) {
    return fault;
  }
  head_.set_total_rows(states_.size());
  return states_.empty() ? "it has no instant" : std::string();
}

void SolvedTrace::start_over() {
  values_.clear();
  states_.clear();
}

std::size_t SolvedTrace::bytes() const {
  return values_.size() * sizeof(double) + states_.size() + head_.ByteSizeLong();
}

protocol::TraceReply SolvedTrace::reply(std::uint64_t first_row) const {
  protocol::TraceReply reply = head_;
  if (first_row > 0) {
    reply.clear_result();
  }
  const std::size_t first = std::min<std::uint64_t>(first_row, rows());
  const std::size_t row_bytes = numbers_a_row_ * sizeof(double) + 1;
  const std::size_t count =
      std::min(rows() - first, std::max<std::size_t>(kReplyBytes / row_bytes, 1));
  const double* values = values_.data() + first * numbers_a_row_;
  reply.mutable_rows()->mutable_values()->Add(values, values + count * numbers_a_row_);
  reply.mutable_rows()->set_states(states_.substr(first, count));
  return reply;
}

void KeptTraces::keep(const TraceKey& key, SolvedTrace trace) {
  bytes_ += trace.bytes();
  kept_.push_front({key, std::move(trace)});
  while (kept_.size() > 1 && bytes_ > most_bytes_) {
    bytes_ -= kept_.back().trace.bytes();
    kept_.pop_back();
  }
}

const SolvedTrace* KeptTraces::find(const TraceKey& key) {
  const auto found =
      std::find_if(kept_.begin(), kept_.end(), [&](const Kept& kept) { return kept.key == key; });
  if (found == kept_.end()) {
    return nullptr;
  }
  kept_.splice(kept_.begin(), kept_, found);
  return &found->trace;
}

}  // namespace oblique::server
