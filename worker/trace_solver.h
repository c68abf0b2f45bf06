#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
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
  /// `every`: K; 0: the smallest power of 2 with which the rows have at most `most_bytes`.
  TraceRows(std::uint64_t every, std::size_t most_bytes);

  void add(const solver::TraceRow& row);
  /// Moves the rows into the message. If they have more than `most_bytes` it gets none, and the
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
  std::size_t most_rows() const;

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

/// Solves the point of an order over a fall of `falls` and gives its instants to `sink`: the same
/// bits as in a batch. The result's number is 0. Nothing is thrown for a point without an answer,
/// nor for an order that makes no sense: it fails.
protocol::PointResult solve_trace(const protocol::TraceOrder& order,
                                  const solver::Tracing::Sink& sink, solver::FallCache& falls);

/// Solves points for traces, one at a time, on a thread of its own beside those of the batches.
class TraceSolver {
 public:
  /// Solves the point of an order and passes its instants to the sink. Must not throw. If there is
  /// no such function, no order is taken.
  using Solve = std::function<protocol::PointResult(const protocol::TraceOrder&,
                                                    const solver::Tracing::Sink&)>;

  /// `has_trace` is called when a trace can be collected, also on the solving thread; it must not
  /// call back.
  TraceSolver(Solve solve, std::function<void()> has_trace,
              std::size_t most_bytes = protocol::kMaxTraceBytes);
  /// Waits for the point that is being solved.
  ~TraceSolver();
  TraceSolver(const TraceSolver&) = delete;
  TraceSolver& operator=(const TraceSolver&) = delete;

  /// While an order is being solved another one is answered as not taken.
  void take(protocol::TraceOrder order);
  /// The order will be answered as not taken, once its point is solved. An unknown number has no
  /// effect.
  void cancel(std::uint64_t trace_id);
  /// No order so far will be answered.
  void drop_all();

  bool is_solving() const;

  /// Answers to orders that were not collected yet.
  std::vector<protocol::Trace> collect();

 private:
  struct Job {
    protocol::TraceOrder order;
    bool is_cancelled = false;
    bool is_dropped = false;
  };

  void work(const std::stop_token& stop);

  const Solve solve_;
  const std::function<void()> has_trace_;
  const std::size_t most_bytes_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<Job> job_;               // guarded by mutex_; its order stays as it is
  std::vector<protocol::Trace> traces_;  // guarded by mutex_
  std::jthread thread_;                  // last: it uses all the others
};

}  // namespace oblique::worker
