#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "proto/oblique.pb.h"
#include "server/scheduler/scheduler.h"
#include "server/service/point_rates.h"
#include "server/service/reuse_tracker.h"
#include "server/service/study_states.h"
#include "server/service/worker_sessions.h"
#include "server/service/write_ledger.h"

// The status of studies and workers as clients and the page get it.
namespace oblique::server {

struct StatusSources {
  const Scheduler& scheduler;
  const StudyStates& states;
  const WriteLedger& ledger;
  const PointRates& rates;  ///< of studies
  const ReuseTracker& reuse;
  const WorkerSessions& workers;
  const PointRates& worker_rates;
};

/// Throws std::out_of_range for a study that is not durable.
protocol::StudyStatus study_status(StudyId id, const StatusSources& sources, Instant now);
protocol::WorkerStatus worker_status(WorkerId id, const StatusSources& sources, Instant now);

}  // namespace oblique::server
