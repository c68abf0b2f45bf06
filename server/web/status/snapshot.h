#pragma once

#include <nlohmann/json.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "proto/oblique.pb.h"
#include "server/network/network.h"
#include "server/scheduler/scheduler.h"
#include "server/service/client_handler.h"
#include "server/service/study_states.h"
#include "server/store/writer.h"

namespace oblique::server {

class Service;

/// The state of the server at one moment, made by the event loop for the HTTP thread. Numbers of
/// points count running and paused studies unless stated otherwise.
struct Snapshot {
  std::int64_t made_ms = 0;           ///< time on the steady clock
  std::uint64_t points_solved = 0;    ///< solved points stored since the server started
  std::uint64_t points_failed = 0;    ///< failed points stored since the server started
  std::uint64_t results_ignored = 0;  ///< StoredPoints::ignored
  std::uint64_t points_open = 0;      ///< number of open points in running studies
  std::uint64_t points_leased = 0;
  double points_per_s = 0.0;
  double thread_s_per_point = 0.0;  ///< average of the last batches; 0 if unknown
  std::array<std::uint64_t, kStudyStates> studies_by_state{};
  /// The first kShownStudies running and paused studies: highest priority first, then oldest.
  std::vector<protocol::StudyStatus> studies;
  std::uint64_t unlisted = 0;                   ///< number of running and paused studies not shown
  std::vector<protocol::WorkerStatus> workers;  ///< the first kShownWorkers workers
  WorkerGroups groups{};                        ///< number of workers in each state

  Histogram commit_s{{}};
  std::uint64_t writer_bytes = 0;  ///< size of results that are not durable yet [bytes]
  std::string database_fault;      ///< why the database takes no results, or empty
  bool is_stopping = false;
  std::array<std::uint64_t, kRefusalCauses> refusals{};  ///< number of refused peers by cause
  QueryCounts queries;

  /// Returns the number of threads that would solve the open points within a minute. If the time of
  /// a point is unknown, returns 1 while points are open.
  std::uint64_t threads_wanted() const;
};

inline constexpr std::size_t kShownStudies = 50;
inline constexpr std::size_t kShownWorkers = 100;

struct SnapshotSources {
  const Service& service;
  const Network& network;
  const Writer& writer;
};

/// Takes time proportional to the number of running and paused studies and of workers.
Snapshot take_snapshot(const SnapshotSources& sources, std::int64_t now_ms);

/// The JSON includes `left_s`, the remaining time [s]; null if unknown.
nlohmann::ordered_json study_json(const protocol::StudyStatus& study);
nlohmann::ordered_json worker_json(const protocol::WorkerStatus& worker);
/// Returns a JSON array of the elements of a list.
template <class List, class ToJson>
nlohmann::ordered_json json_list(const List& list, const ToJson& to_json) {
  auto json = nlohmann::ordered_json::array();
  for (const auto& element : list) {
    json.push_back(to_json(element));
  }
  return json;
}

/// Returns the overview for the page, as one line of JSON.
std::string overview_json(const Snapshot& snapshot);

/// Sizes that the file system reports for the database [bytes]; NaN if it reports none.
struct DiskUsage {
  double database = 0.0;
  double wal = 0.0;  ///< 0 if there is no write-ahead log
  double free = 0.0;
};
DiskUsage disk_usage(const std::string& database);

struct MetricSources {
  const Snapshot& snapshot;
  DiskUsage disk;
  const std::map<unsigned, std::uint64_t>& http_answers;  ///< number of answers by status
  std::string solver_version;
};

/// Returns all metrics in Prometheus' text format 0.0.4. README.md lists them.
std::string metrics_text(const MetricSources& sources);

/// The latest snapshot, published by the event loop for the HTTP thread.
class SnapshotCache {
 public:
  void publish(Snapshot snapshot) {
    auto shared = std::make_shared<const Snapshot>(std::move(snapshot));
    const std::lock_guard lock(mutex_);
    latest_.swap(shared);
  }
  /// Returns the latest snapshot; null before the first one.
  std::shared_ptr<const Snapshot> latest() const {
    const std::lock_guard lock(mutex_);
    return latest_;
  }

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const Snapshot> latest_;  // guarded by mutex_
};

}  // namespace oblique::server
