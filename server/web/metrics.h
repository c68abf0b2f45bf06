#pragma once

#include <cstdint>
#include <string>

#include "server/web/http/http_server.h"
#include "server/web/process_numbers.h"
#include "server/web/snapshot.h"

namespace oblique::server {

/// What the metrics show beside a snapshot.
struct MetricSources {
  const Snapshot& snapshot;
  const ProcessNumbers& process;
  const DiskNumbers& disk;
  const HttpCounts& http;
  double loop_turned_s;  ///< age of its last turn
  double uptime_s;
  std::string solver_version;
};

/// All metrics; README.md has the list.
std::string metrics_text(const MetricSources& sources);

}  // namespace oblique::server
