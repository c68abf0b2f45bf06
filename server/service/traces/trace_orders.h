#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "proto/oblique.pb.h"
#include "server/scheduler/scheduler_events.h"
#include "server/service/traces/solved_trace.h"

namespace oblique::server {

struct TraceLimits {
  std::size_t most_waiting = 64;                    ///< requests without an answer
  std::size_t most_requests_of_one = 32;            ///< of these, of one who asks
  std::size_t most_of_one = 4;                      ///< traces that these are for
  std::size_t most_at_work = 8;                     ///< traces that are with workers
  std::size_t most_bytes = std::size_t{8} << 20U;   ///< of one trace
  std::size_t kept_bytes = std::size_t{32} << 20U;  ///< of those that are kept
  std::int64_t time_ms = 60'000;                    ///< that one has who says nothing of it
  std::int64_t longest_time_ms = 600'000;
};

/// Somebody who wants to see a trace.
struct TraceQuestion {
  std::uint64_t ticket;  ///< by which he is answered
  TraceKey key;
  std::uint64_t first_row = 0;
  std::int64_t time_limit_ms = 0;  ///< 0: the usual one
};

struct SendOrder {
  WorkerId worker;
  protocol::TraceOrder order;
};
struct CancelOrder {
  WorkerId worker;
  std::uint64_t trace_id;
};
struct AnswerTrace {
  std::uint64_t ticket;
  protocol::TraceReply reply;
};
struct RefuseTrace {
  std::uint64_t ticket;
  std::string reason;  ///< a sentence for people
};
using TraceEffect = std::variant<SendOrder, CancelOrder, AnswerTrace, RefuseTrace>;

/// Decides which worker solves which trace, beside all batches: a worker gets one at a time, those
/// whose solver has the version of the study's results before others. Who asks for what another
/// waits for already shares it. No I/O, no clock, no thread. Not thread-safe.
class TraceOrders {
 public:
  TraceOrders(const TraceLimits& limits, std::string server_version)
      : limits_(limits), server_version_(std::move(server_version)), kept_(limits.kept_bytes) {}

  /// Answers from what is kept, shares what is under way, or refuses. False: somebody must say
  /// what the point is, by `order`.
  bool answer(const TraceQuestion& question, std::int64_t now_ms);
  /// The same question with its point; `version` is that of the study's results, or empty.
  void order(const TraceQuestion& question, const TracedPoint& point, const std::string& version,
             std::int64_t now_ms);
  /// Who asked under that ticket waits no more.
  void leave(std::uint64_t ticket);
  /// Whether the trace that he waits for is with a worker.
  bool is_at_work(std::uint64_t ticket) const;

  void joined(WorkerId worker, const std::string& name, const std::string& version,
              const std::string& instruction_set);
  /// For whatever reason.
  void left(WorkerId worker);
  /// It does not read what it is sent, or reads again.
  void set_busy(WorkerId worker, bool is_busy);
  void part(WorkerId worker, const protocol::TracePart& part);
  void tick(std::int64_t now_ms);
  /// The server stops: everybody is refused.
  void stop(const std::string& reason);

  std::size_t waiting() const { return tickets_.size(); }
  /// What is to be done, in order.
  std::vector<TraceEffect> take_effects() { return std::exchange(effects_, {}); }

 private:
  struct Waiter {
    std::uint64_t ticket;
    std::uint64_t first_row;
    std::int64_t deadline_ms;
  };
  struct Job {
    protocol::TraceOrder order;
    std::string version;
    SolvedTrace trace;
    std::vector<Waiter> waiters;
    std::optional<WorkerId> worker;  ///< none: it waits for one
    std::set<WorkerId> not_taken_by;
    int losses = 0;  ///< workers that went while they solved it
  };
  struct Solver {
    std::string name;
    std::string version;
    std::string instruction_set;
    bool is_busy = false;
    std::uint64_t order = 0;  ///< that it has not answered; 0: none
    std::uint64_t last_order = 0;
  };
  using Jobs = std::map<TraceKey, Job>;
  using Solvers = std::map<WorkerId, Solver>;

  std::string objection_to(const TraceQuestion& question) const;
  Waiter waiter_of(const TraceQuestion& question, std::int64_t now_ms) const;
  void dispatch();
  int rank(const Solver& solver, const Job& job) const;
  /// The one that should solve it: none, because all are at work; or refused, because nobody can.
  std::optional<WorkerId> solver_for(const Job& job, bool& has_any);
  void hand_to(WorkerId worker, Job& job);
  void finish(Jobs::iterator job);
  void fail(Jobs::iterator job, const std::string& reason);
  void take_from(Job& job);
  void forget(Jobs::iterator job);

  TraceLimits limits_;
  std::string server_version_;
  KeptTraces kept_;
  Jobs jobs_;
  std::deque<TraceKey> queue_;  // of jobs that no worker has
  std::map<std::uint64_t, TraceKey> tickets_;
  Solvers solvers_;
  std::deque<TraceKey> deadly_;  // that workers were lost with, the latest ones
  std::uint64_t last_trace_id_ = 0;
  std::size_t at_work_ = 0;
  std::string stopping_;
  std::vector<TraceEffect> effects_;
};

}  // namespace oblique::server
