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
  struct Kept {
    std::uint64_t instant;  ///< of the contact
    bool is_always_kept;
  };

  bool stays(const Kept& row) const { return row.is_always_kept || row.instant % every_ == 0; }
  std::size_t most_rows() const;
  void remove_last();
  void thin();

  std::uint64_t every_;
  const bool chooses_every_;
  const std::size_t most_bytes_;
  std::size_t row_numbers_ = 0;
  std::uint64_t instants_ = 0;
  std::uint64_t always_kept_ = 0;  ///< rows
  std::string last_state_;
  bool is_too_long_ = false;
  std::vector<Kept> kept_;
  std::string states_;
  std::vector<double> values_;
};

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
              std::size_t most_bytes = protocol::kMostTraceBytes);
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
