#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "server/web/status/snapshot.h"

namespace oblique::server {

/// What the file system reports about the database [bytes]. NaN: it reports nothing.
struct DiskUsage {
  double database = 0.0;
  double wal = 0.0;  ///< 0 if there is no write-ahead log
  double free = 0.0;
};
DiskUsage disk_usage(const std::string& database);

struct MetricSources {
  const Snapshot& snapshot;
  DiskUsage disk;
  const std::map<unsigned, std::uint64_t>& http_answers;  ///< by status
  std::string solver_version;
};

/// All metrics, which README.md lists, in Prometheus' text format 0.0.4.
std::string metrics_text(const MetricSources& sources);

}  // namespace oblique::server
