#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/result_message.h"
#include "worker/solver/fall_cache.h"
#include "worker/solver/model/trace.h"

namespace oblique::worker {

/// The rows of a trace that its message has: the fall, each K-th instant of the contact, those at
/// which phases end, and the last.
class TraceRows {
 public:
  /// `every` is K. If it is 0, K is the smallest power of 2 for which the rows have at most
  /// `most_bytes`.
  TraceRows(std::uint64_t every, std::size_t most_bytes);

  void add(const solver::TraceRow& row);
  /// Moves the rows into the message. If they have more than `most_bytes`, it gets no rows but the
  /// least `every` with which they would fit.
  void move_to(protocol::Trace& trace);

 private:
  struct Row {
    std::uint64_t instant;  ///< of the contact
    bool is_always_kept;
    char state;
    std::vector<double> numbers;
  };

  bool stays(const Row& row) const { return row.is_always_kept || row.instant % every_ == 0; }
  std::size_t most_rows() const { return most_bytes_ / row_bytes_; }

  std::uint64_t every_;
  const bool chooses_every_;
  const std::size_t most_bytes_;
  std::size_t row_bytes_ = 1;
  std::uint64_t instants_ = 0;
  std::uint64_t always_kept_ = 0;  ///< rows
  std::string last_state_;
  bool is_too_long_ = false;
  std::vector<Row> rows_;
};

/// Solves the point of an order with a fall from `falls` and passes its instants to `sink`. The
/// result's number is 0. A wrong order gives a failed result.
protocol::PointResult solve_trace(const protocol::TraceOrder& order,
                                  const solver::Tracing::Sink& sink, solver::FallCache& falls);

/// Solves points for traces, one at a time, on a thread beside those of the batches.
class TraceSolver {
 public:
  /// Solves the point of an order and passes its instants to the sink. Must not throw.
  using Solve = std::function<protocol::PointResult(const protocol::TraceOrder&,
                                                    const solver::Tracing::Sink&)>;

  /// Without `solve` no order is taken. `has_trace` is called when a trace can be collected, also
  /// on the solving thread.
  TraceSolver(Solve solve, std::function<void()> has_trace,
              std::size_t most_bytes = protocol::kMaxTraceBytes);

  /// While an order is being solved, others are answered as not taken.
  void take(const protocol::TraceOrder& order);
  /// The order will be answered as not taken when its point is solved. Ignores an unknown number.
  void cancel(std::uint64_t trace_id);
  /// No order received so far will be answered.
  void drop_all();
  bool is_solving() const;
  /// Answers since the last call.
  std::vector<protocol::Trace> collect();

 private:
  protocol::Trace solved(const protocol::TraceOrder& order) const;
  void gather();

  const Solve solve_;
  const std::function<void()> has_trace_;
  const std::size_t most_bytes_;
  std::future<protocol::Trace> running_;
  std::uint64_t trace_id_ = 0;  ///< of running_
  bool is_cancelled_ = false;   ///< running_ will be answered as not taken
  bool is_dropped_ = false;     ///< running_ will not be answered
  std::vector<protocol::Trace> traces_;
  std::jthread thread_;  ///< last: it uses the other members and is waited for
};

}  // namespace oblique::worker
