#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <string>

#include "proto/oblique.pb.h"
#include "server/scheduler/scheduler.h"
#include "server/service/study_states.h"
#include "server/service/worker_sessions.h"
#include "server/service/write_ledger.h"

namespace oblique::server {

/// Completed points per second over the last 5 s, by study or worker.
class PointRates {
 public:
  using Id = std::uint64_t;

  /// Adds completed points. The rate of a new ID is measured from `since_ms` on.
  void add(Id id, std::uint64_t points, std::int64_t since_ms, std::int64_t now_ms) {
    Recent& recent = recent_.try_emplace(id, Recent{since_ms}).first->second;
    if (recent.points.empty() || now_ms - recent.points.back().at_ms >= kResolution_ms) {
      recent.points.push_back({now_ms, 0});
    }
    recent.points.back().points += points;
    while (now_ms - recent.points.front().at_ms >= kSpan_ms) {
      recent.points.pop_front();
    }
  }
  void forget(Id id) { recent_.erase(id); }
  /// Removes IDs without recent points. Must be called from time to time.
  void forget_old(std::int64_t now_ms) {
    std::erase_if(recent_, [now_ms](const auto& entry) {
      return now_ms - entry.second.points.back().at_ms >= kSpan_ms;
    });
  }

  double points_per_s(Id id, std::int64_t now_ms) const {
    const auto found = recent_.find(id);
    return found == recent_.end() ? 0.0 : rate_of(found->second, now_ms);
  }
  /// Returns the sum over all IDs.
  double points_per_s(std::int64_t now_ms) const {
    double sum = 0.0;
    for (const auto& [id, recent] : recent_) {
      sum += rate_of(recent, now_ms);
    }
    return sum;
  }

 private:
  static constexpr std::int64_t kSpan_ms = 5000;
  static constexpr std::int64_t kResolution_ms = 100;
  struct Sample {
    std::int64_t at_ms;
    std::uint64_t points;
  };
  struct Recent {
    std::int64_t since_ms;
    std::deque<Sample> points{};  ///< the oldest first
  };

  static double rate_of(const Recent& recent, std::int64_t now_ms) {
    std::uint64_t points = 0;
    for (const Sample& sample : recent.points) {
      points += now_ms - sample.at_ms < kSpan_ms ? sample.points : 0;
    }
    const std::int64_t span_ms = std::min(kSpan_ms, now_ms - recent.since_ms);
    return span_ms <= 0 ? 0.0 : 1000.0 * static_cast<double>(points) / static_cast<double>(span_ms);
  }

  std::map<Id, Recent> recent_;
};

/// Parts of the service that all of its handlers use.
struct Core {
  Ports& ports;
  Scheduler& scheduler;
  StudyStates& states;
  WriteLedger& ledger;
  WorkerSessions& workers;
  PointRates& rates;  ///< rates of studies
  PointRates& worker_rates;
  std::string solver_version;  ///< solver version of the server
  /// Passes an event to the scheduler and carries out its effects.
  std::function<void(const Event&, Instant)> feed;
};

// These functions return the status of studies and workers as messages for clients and the page.

/// Throws std::out_of_range for a study that is not durable.
protocol::StudyStatus study_status(StudyId id, const Core& core, Instant now);
/// Returns an empty message if the study reuses no results.
protocol::ReusedPoints reuse_status(const Reuse& reuse);
protocol::WorkerStatus worker_status(WorkerId id, const Core& core, Instant now);

}  // namespace oblique::server
