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

namespace oblique::server {

/// The parts of the service that its handlers share.
struct Core {
  Ports& ports;
  Scheduler& scheduler;
  StudyStates& states;
  WriteLedger& ledger;
  ReuseTracker& reuse;
  WorkerSessions& workers;
  PointRates& rates;  ///< of studies
  PointRates& worker_rates;
  Feed feed;
};

// The status of studies and workers as clients and the page get it.

/// Throws std::out_of_range for a study that is not durable.
protocol::StudyStatus study_status(StudyId id, const Core& core, Instant now);
protocol::WorkerStatus worker_status(WorkerId id, const Core& core, Instant now);

}  // namespace oblique::server
