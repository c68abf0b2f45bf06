#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "server/network/network.h"
#include "server/scheduler/scheduler.h"
#include "server/service/client_handler.h"
#include "server/store/writer.h"

namespace oblique::server {

class Service;

/// A study as the numbers show it.
struct StudyNumbers {
  std::string name;
  std::uint64_t solved;
  std::uint64_t failed;
  std::uint64_t leased;
  std::uint64_t waiting;  ///< or on their way to the disk
  double points_per_s;
};

/// Messages of the peers of one port, as bytes.
struct PortTraffic {
  std::uint64_t received_bytes = 0;
  std::uint64_t sent_bytes = 0;
};

struct PortNumbers {
  std::uint64_t connections = 0;
  PortTraffic traffic;
};

/// What the holder of a key has submitted that is not done.
struct OpenNumbers {
  std::uint64_t studies = 0;
  std::uint64_t points = 0;  ///< without a result
};

/// How the server stands at one moment: plain values, made by the loop and shown by other threads.
/// Points are of studies that run or are paused, unless something else is said.
struct Snapshot {
  std::int64_t made_ms = 0;         ///< by the steady clock
  std::uint64_t points_solved = 0;  ///< stored since the server began
  std::uint64_t points_failed = 0;
  std::uint64_t points_open = 0;  ///< of running studies
  std::uint64_t points_leased = 0;
  double points_per_s = 0.0;
  double thread_s_per_point = 0.0;                    ///< of the last batches; 0: not known
  std::array<std::uint64_t, kStudyStates> studies{};  ///< by state
  /// Of the highest priority, the oldest first.
  std::vector<StudyNumbers> listed;
  std::uint64_t unlisted = 0;
  bool is_for_page = false;
  /// Of a snapshot for the page: the same studies, and the first workers, with all that is known of
  /// them.
  std::vector<protocol::StudyStatus> shown_studies;
  std::vector<protocol::WorkerStatus> shown_workers;
  std::map<std::string, OpenNumbers> open_by_key;  ///< by its name

  std::uint64_t batches_leased = 0;
  Histogram batch_s{{}};
  std::array<Crew, kCrewStates> crews{};

  CommitCounts commits;
  std::uint64_t writer_jobs = 0;   ///< not durable yet
  std::uint64_t writer_bytes = 0;  ///< of results that are not
  std::string database_fault;      ///< why it takes no results; empty: it does
  bool is_stopping = false;

  std::uint64_t held_in_bytes = 0;
  std::uint64_t waiting_out_bytes = 0;
  PortNumbers clients;
  PortNumbers workers;
  std::uint64_t connections_ended = 0;
  std::array<std::uint64_t, kRefusalCauses> refusals{};  ///< by cause
  std::uint64_t bad_frames = 0;
  QueryCounts queries;

  /// Threads with which the open points would be solved within a minute.
  std::uint64_t threads_wanted() const;
};

/// What a snapshot is made of.
struct SnapshotSources {
  const Service& service;
  const Network& network;
  const Writer& writer;
  Network::Port client_port;
  PortTraffic client_traffic;
  Network::Port worker_port;
  PortTraffic worker_traffic;
  std::uint64_t connections_ended;
};

/// Costs in proportion to the studies that run or are paused, and to the workers.
Snapshot take_snapshot(const SnapshotSources& sources, std::int64_t now_ms, bool for_page = false);

/// So many studies have numbers of their own at most: each is a few series more to keep.
inline constexpr std::size_t kListedStudies = 50;
/// So many workers are shown on the page.
inline constexpr std::size_t kShownWorkers = 100;

}  // namespace oblique::server
