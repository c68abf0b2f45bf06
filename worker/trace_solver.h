#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <vector>

#include "proto/oblique.pb.h"
#include "worker/solver/model/trace.h"
#include "worker/trace_thinning.h"

namespace oblique::worker {

/// Solves points that somebody wants to look at, one at a time, on a thread of its own beside those
/// of the batches: neither waits for the other. An order is answered in parts, the last of which
/// ends it.
class TraceSolver {
 public:
  /// Solves the point of an order and gives its instants to the sink. Must not throw. Where there
  /// is none, no order is taken.
  using Solve = std::function<protocol::PointResult(const protocol::TraceOrder&,
                                                    const solver::Tracing::Sink&)>;

  /// `has_part` is called on the solving thread whenever a part can be collected; it must not call
  /// back.
  TraceSolver(Solve solve, std::function<void()> has_part);
  /// Waits for the point that is being solved.
  ~TraceSolver();
  TraceSolver(const TraceSolver&) = delete;
  TraceSolver& operator=(const TraceSolver&) = delete;

  /// While an order is under way another one is not taken, and its answer says so.
  void take(protocol::TraceOrder order);
  /// Nobody wants that trace any more: its answer is that it was not taken. What is being solved
  /// cannot be interrupted. An unknown number is passed over.
  void cancel(std::uint64_t trace_id);
  /// Forgets all orders: none of them is answered.
  void drop_all();

  bool is_solving() const;

  /// Parts that were not collected yet, in order.
  std::vector<protocol::TracePart> collect();

 private:
  /// Rows of a part have about so many bytes.
  static constexpr std::size_t kPartBytes = std::size_t{256} << 10U;

  /// What is solved, and what of it is on its way out.
  struct Job {
    protocol::TraceOrder order;
    protocol::TracePart part;  ///< that grows
    std::uint64_t bytes = 0;   ///< of all rows so far
    std::optional<TraceThinning> thinning =
        {};  ///< of one with the shape, which is to be looked at
    bool is_cancelled = false;
    bool is_dropped = false;
  };

  void work(const std::stop_token& stop);
  void add_row(const solver::TraceRow& row);
  void add_numbers(const std::vector<double>& numbers, std::uint8_t state);
  void hand_on(protocol::TracePart part);
  void end(protocol::PointResult result);

  const Solve solve_;
  const std::function<void()> has_part_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<Job>
      job_;  ///< `part`, `bytes` and `thinning` are the thread's own, the rest is guarded
  std::vector<protocol::TracePart> parts_;
  std::jthread thread_;  // last: it uses all the others
};

}  // namespace oblique::worker
