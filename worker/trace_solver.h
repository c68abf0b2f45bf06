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

/// Selects the rows of a trace for its message: the fall, each K-th instant of the contact, the
/// ends of phases and the last instant.
class TraceRows {
 public:
  /// `every` is K; for 0, K is the smallest power of 2 with which the rows fit in `most_bytes`.
  TraceRows(std::uint64_t every, std::size_t most_bytes);

  void add(const solver::TraceRow& row);
  /// Moves the rows into the message. If they need more than `most_bytes`, the message contains no
  /// rows, only the smallest `every` with which they would fit.
  void move_to(protocol::Trace& trace);

 private:
  struct Row {
    std::uint64_t instant;  ///< number of the instant in the contact
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
  std::uint64_t always_kept_ = 0;  ///< number of rows
  std::string last_state_;
  bool is_too_long_ = false;
  std::vector<Row> rows_;
};

/// Solves the point of an order with a fall from `falls` and passes its instants to `sink`. Returns
/// the result, with the point number 0. For an invalid order it is a failed result.
protocol::PointResult solve_trace(const protocol::TraceOrder& order,
                                  const solver::Tracing::Sink& sink, solver::FallCache& falls);

/// Solves points for traces, one at a time, on a thread of its own.
class TraceSolver {
 public:
  /// Solves the point of an order and passes its instants to the sink. Must not throw.
  using Solve = std::function<protocol::PointResult(const protocol::TraceOrder&,
                                                    const solver::Tracing::Sink&)>;

  /// Without `solve` all orders are declined. `has_trace` is called when a trace can be collected,
  /// on the calling or the solving thread.
  TraceSolver(Solve solve, std::function<void()> has_trace,
              std::size_t most_bytes = protocol::kMaxTraceBytes);

  /// Declines the order if another one is being solved.
  void take(const protocol::TraceOrder& order);
  /// Declines the order with this number once its point is solved. Ignores an unknown number.
  void cancel(std::uint64_t trace_id);
  /// Leaves all orders so far without an answer.
  void drop_all();
  bool is_solving() const;
  /// Returns the answers that became ready since the last call.
  std::vector<protocol::Trace> collect();

 private:
  protocol::Trace solved(const protocol::TraceOrder& order) const;
  void gather();

  const Solve solve_;
  const std::function<void()> has_trace_;
  const std::size_t most_bytes_;
  std::future<protocol::Trace> running_;
  std::uint64_t trace_id_ = 0;  ///< of running_
  bool is_cancelled_ = false;   ///< running_ will be declined
  bool is_dropped_ = false;     ///< running_ will not be answered
  std::vector<protocol::Trace> traces_;
  std::jthread thread_;  ///< declared last: the thread uses the other members
};

}  // namespace oblique::worker
