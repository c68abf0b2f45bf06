#include "server/web/metrics.h"

#include <array>
#include <cstddef>
#include <string_view>

#include "server/web/metric_text.h"

namespace oblique::server {
namespace {

constexpr MetricType kCounter = MetricType::kCounter;
constexpr MetricType kGauge = MetricType::kGauge;

template <typename Number>
void single(MetricText& out, std::string_view name, MetricType type, std::string_view help,
            Number value) {
  out.family(name, type, help);
  out.sample(value);
}

void add_points(MetricText& out, const Snapshot& now) {
  single(out, "oblique_points_solved_total", kCounter, "Points whose solution was stored.",
         now.points_solved);
  single(out, "oblique_points_failed_total", kCounter, "Points that were stored as failed.",
         now.points_failed);
  single(out, "oblique_points_open", kGauge,
         "Points of running studies that have no result in the database.", now.points_open);
  single(out, "oblique_points_leased", kGauge, "Points that are at workers.", now.points_leased);
  single(out, "oblique_points_per_second", kGauge, "Points stored a second, over the last seconds.",
         now.points_per_s);
  single(out, "oblique_threads_wanted", kGauge,
         "Threads that would solve the open points within a minute; 1 while no pace is known.",
         now.threads_wanted());
}

void add_studies(MetricText& out, const Snapshot& now) {
  out.family("oblique_studies", kGauge, "Studies by state.");
  for (std::size_t i = 0; i < now.studies.size(); ++i) {
    out.sample(now.studies[i], {{"state", state_name(static_cast<StudyState>(i))}});
  }
  out.family("oblique_study_points", kGauge,
             "Points of the studies that are not done, of those with the highest priority.");
  for (const StudyNumbers& study : now.listed) {
    const std::array<std::pair<const char*, std::uint64_t>, 4> states{{{"solved", study.solved},
                                                                       {"failed", study.failed},
                                                                       {"leased", study.leased},
                                                                       {"waiting", study.waiting}}};
    for (const auto& [state, points] : states) {
      out.sample(points, {{"study", study.name}, {"state", state}});
    }
  }
  out.family("oblique_study_points_per_second", kGauge,
             "Points stored a second, of the same studies.");
  for (const StudyNumbers& study : now.listed) {
    out.sample(study.points_per_s, {{"study", study.name}});
  }
  single(out, "oblique_studies_unlisted", kGauge,
         "Studies that are not done and have no series of their own.", now.unlisted);
}

void add_batches(MetricText& out, const Snapshot& now) {
  single(out, "oblique_batches_leased", kGauge, "Batches at workers.", now.batches_leased);
  out.family("oblique_batch_duration_seconds", MetricType::kHistogram,
             "From handing a batch out to its last result.");
  out.sample(now.batch_s);
  const auto state = [](std::size_t i) { return crew_name(static_cast<CrewState>(i)); };
  out.family("oblique_workers", kGauge, "Workers by what they do.");
  for (std::size_t i = 0; i < now.crews.size(); ++i) {
    out.sample(now.crews[i].workers, {{"state", state(i)}});
  }
  out.family("oblique_worker_threads", kGauge, "Threads of workers by what these do.");
  for (std::size_t i = 0; i < now.crews.size(); ++i) {
    out.sample(now.crews[i].threads, {{"state", state(i)}});
  }
}

void add_writer(MetricText& out, const Snapshot& now, const DiskNumbers& disk) {
  out.family("oblique_commit_duration_seconds", MetricType::kHistogram,
             "What a transaction of the writer took.");
  out.sample(now.commits.duration_s);
  out.family("oblique_commit_rows", MetricType::kHistogram, "Results in a transaction.");
  out.sample(now.commits.rows);
  single(out, "oblique_writer_queue_jobs", kGauge, "Changes on their way to the disk.",
         now.writer_jobs);
  single(out, "oblique_writer_queue_bytes", kGauge,
         "Results on their way to the disk, as bytes of their messages.", now.writer_bytes);
  single(out, "oblique_database_writable", kGauge, "1: the database takes results.",
         std::uint64_t{now.database_fault.empty() ? 1U : 0U});
  out.family("oblique_database_bytes", kGauge, "Size of the database and its write-ahead log.");
  out.sample(disk.database_bytes, {{"file", "database"}});
  out.sample(disk.wal_bytes, {{"file", "wal"}});
  single(out, "oblique_disk_free_bytes", kGauge, "Room left on the database's disk.",
         disk.free_bytes);
}

void add_peers(MetricText& out, const Snapshot& now) {
  const std::array<std::pair<const char*, const PortNumbers*>, 2> ports{
      {{"clients", &now.clients}, {"workers", &now.workers}}};
  out.family("oblique_connections", kGauge, "Connections, those too that still shake hands.");
  for (const auto& [port, numbers] : ports) {
    out.sample(numbers->connections, {{"port", port}});
  }
  out.family("oblique_received_bytes_total", kCounter, "Messages of peers.");
  for (const auto& [port, numbers] : ports) {
    out.sample(numbers->traffic.received_bytes, {{"port", port}});
  }
  out.family("oblique_sent_bytes_total", kCounter, "Messages to peers.");
  for (const auto& [port, numbers] : ports) {
    out.sample(numbers->traffic.sent_bytes, {{"port", port}});
  }
  single(out, "oblique_connections_ended_total", kCounter, "Connections that the server ended.",
         now.connections_ended);
  out.family("oblique_peers_refused_total", kCounter, "Peers that were not let in or sent away.");
  for (std::size_t i = 0; i < now.refusals.size(); ++i) {
    out.sample(now.refusals.at(i), {{"cause", name_of(static_cast<RefusalCause>(i))}});
  }
  out.family("oblique_held_bytes", kGauge,
             "Messages that are incomplete or not taken, and bytes that peers have not taken.");
  out.sample(now.held_in_bytes, {{"direction", "in"}});
  out.sample(now.waiting_out_bytes, {{"direction", "out"}});
  single(out, "oblique_bad_frames_total", kCounter, "Frames that no sound peer sends.",
         now.bad_frames);
  out.family("oblique_queries", kGauge, "Queries of clients.");
  out.sample(now.queries.waiting, {{"state", "waiting"}});
  out.sample(now.queries.running, {{"state", "running"}});
}

void add_keys(MetricText& out, const Snapshot& now) {
  out.family("oblique_key_studies_open", kGauge, "Studies of a key that are not done.");
  for (const auto& [key, open] : now.open_by_key) {
    out.sample(open.studies, {{"key", key}});
  }
  out.family("oblique_key_points_open", kGauge, "Points of these that have no result.");
  for (const auto& [key, open] : now.open_by_key) {
    out.sample(open.points, {{"key", key}});
  }
}

void add_process(MetricText& out, const ProcessNumbers& process) {
  single(out, "process_cpu_seconds_total", kCounter, "Processor time of the server's process.",
         process.cpu_s);
  single(out, "process_resident_memory_bytes", kGauge, "Memory of the server's process.",
         process.resident_bytes);
  single(out, "process_open_fds", kGauge, "Descriptors that are open.", process.open_descriptors);
  single(out, "process_max_fds", kGauge, "Descriptors that may be open.", process.most_descriptors);
  single(out, "process_start_time_seconds", kGauge, "When the process began, since 1970.",
         process.began_s);
}

void add_http(MetricText& out, const HttpCounts& http) {
  out.family("oblique_http_requests_total", kCounter, "Answers given over HTTP.");
  for (const auto& [status, count] : http.answers) {
    out.sample(count, {{"code", std::to_string(status)}});
  }
  single(out, "oblique_http_connections", kGauge, "HTTP connections.",
         std::uint64_t{http.connections});
  out.family("oblique_http_ended_total", kCounter, "HTTP connections that were ended.");
  out.sample(http.ended_as_slow, {{"cause", "slow"}});
  out.sample(http.ended_for_others, {{"cause", "crowded"}});
}

}  // namespace

std::string metrics_text(const MetricSources& sources) {
  const Snapshot& now = sources.snapshot;
  MetricText out;
  add_points(out, now);
  add_studies(out, now);
  add_batches(out, now);
  add_writer(out, now, sources.disk);
  add_peers(out, now);
  add_keys(out, now);
  out.family("oblique_build_info", kGauge, "Always 1.");
  out.sample(std::uint64_t{1},
             {{"version", OBLIQUE_VERSION}, {"solver_version", sources.solver_version}});
  single(out, "oblique_uptime_seconds", kGauge, "Since the server began.", sources.uptime_s);
  single(out, "oblique_loop_turned_seconds", kGauge, "Age of the loop's last turn.",
         sources.loop_turned_s);
  add_http(out, sources.http);
  add_process(out, sources.process);
  return out.text();
}

}  // namespace oblique::server
