#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/scheduler/scheduler.h"
#include "tests/support/points.h"

namespace oblique::server {

/// Returns the effects of type `Kind`, in order.
template <typename Kind>
std::vector<Kind> only(const std::vector<Effect>& effects) {
  std::vector<Kind> kept;
  for (const Effect& effect : effects) {
    if (const auto* wanted = std::get_if<Kind>(&effect)) {
      kept.push_back(*wanted);
    }
  }
  return kept;
}

/// Settings with which a new worker gets as many batches as it requests.
inline SchedulerSettings trusting() {
  SchedulerSettings settings;
  settings.newcomer_batches = 1'000'000;
  return settings;
}

/// Runs a scheduler with a clock that the tests set, and checks its invariants after each event.
class SchedulerBench {
 public:
  explicit SchedulerBench(const SchedulerSettings& settings = {}, std::string solver_version = {})
      : scheduler(settings, std::move(solver_version)) {}
  /// Adds study 1 with the points of `table`.
  explicit SchedulerBench(const std::shared_ptr<const protocol::PointTable>& table,
                          const SchedulerSettings& settings = {}, std::string solver_version = {})
      : SchedulerBench(settings, std::move(solver_version)) {
    feed(StudyAdded{1, table, {}});
  }

  std::vector<Effect> feed(const Event& event) {
    auto effects = scheduler.handle(event, now_ms);
    scheduler.check_invariants();
    return effects;
  }

  /// Makes a worker join and request `credit` batches. Returns the batches that it gets at once.
  std::vector<SendBatch> join(WorkerId worker, std::uint32_t credit, std::uint32_t threads = 1) {
    feed(WorkerJoined{worker, threads});
    return only<SendBatch>(feed(CreditGiven{worker, credit}));
  }

  /// Like `join`, but for a worker of the given process. Returns all effects.
  std::vector<Effect> join_as(const std::string& process, WorkerId worker, std::uint32_t credit,
                              const std::optional<EndedProcess>& replaced = {}) {
    auto effects = feed(WorkerJoined{worker, 1, process, replaced});
    append(effects, feed(CreditGiven{worker, credit}));
    return effects;
  }

  /// Returns a worker's results of the whole batch, solved in `busy_s`. The results lack the points
  /// that the filter of `table` leaves out.
  ResultsReceived answer_to(const SendBatch& batch, double busy_s = 1e-3,
                            const protocol::PointTable* table = nullptr) {
    ResultsReceived event{batch.worker, batch.study, batch.lease, ++sequence, true, busy_s, {}};
    for (const Interval& range : batch.points) {
      for (std::uint64_t point = range.begin; point < range.end; ++point) {
        if (table == nullptr || table->passes_filter(point)) {
          event.outcomes.push_back({point, false});
        } else {
          event.left_out.insert(point);
        }
      }
    }
    return event;
  }
  std::vector<Effect> solve(const SendBatch& batch, double busy_s = 1e-3) {
    return feed(answer_to(batch, busy_s));
  }

  /// Passes results to the scheduler and then reports them as stored. Returns the effects of both
  /// events.
  std::vector<Effect> store(const ResultsReceived& event) {
    auto effects = feed(event);
    for (const StoreResults& store : only<StoreResults>(effects)) {
      ResultsStored stored{store.worker, store.study, store.sequence, {}, store.left_out};
      for (const std::size_t index : store.accepted) {
        stored.outcomes.push_back(event.outcomes[index]);
      }
      append(effects, feed(stored));
    }
    return effects;
  }
  std::vector<Effect> solve_and_store(const SendBatch& batch, double busy_s = 1e-3,
                                      const protocol::PointTable* table = nullptr) {
    return store(answer_to(batch, busy_s, table));
  }

  /// Solves these batches and all batches that follow, one after another. Returns all batches in
  /// this order.
  std::vector<SendBatch> solve_all(std::vector<SendBatch> batches, double s_per_point = 1e-3,
                                   const protocol::PointTable* table = nullptr) {
    for (std::size_t i = 0; i < batches.size(); ++i) {
      const SendBatch batch = batches[i];
      auto effects =
          solve_and_store(batch, s_per_point * static_cast<double>(batch.count()), table);
      append(effects, feed(CreditGiven{batch.worker, 1}));
      for (const SendBatch& next : only<SendBatch>(effects)) {
        batches.push_back(next);
      }
    }
    return batches;
  }

  /// Solves a batch, taking `s_per_point` for each point. Returns the next batch of the worker.
  SendBatch next_after(const SendBatch& batch, double s_per_point) {
    solve_and_store(batch, s_per_point * static_cast<double>(batch.count()));
    return only<SendBatch>(feed(CreditGiven{batch.worker, 1})).at(0);
  }

  /// Advances the clock in the steps of the server's loop. Workers in `alive` send heartbeats with
  /// their leases. Returns all effects.
  std::vector<Effect> pass(std::int64_t duration_ms, const std::vector<WorkerId>& alive = {}) {
    std::vector<Effect> all;
    const std::int64_t end_ms = now_ms + duration_ms;
    while (now_ms < end_ms) {
      now_ms += 250;
      for (const WorkerId worker : alive) {
        append(all, feed(CreditGiven{worker, 0}));
      }
      append(all, feed(Tick{}));
    }
    return all;
  }

  static void append(std::vector<Effect>& all, std::vector<Effect> more) {
    all.insert(all.end(), more.begin(), more.end());
  }

  Scheduler scheduler;
  std::int64_t now_ms = 1'000'000;
  std::uint64_t sequence = 0;
};

}  // namespace oblique::server
