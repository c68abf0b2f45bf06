#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <system_error>

#include <spdlog/fmt/fmt.h>

#include "server/web/status/snapshot.h"
#include "worker/solver/model/number.h"

namespace oblique::server {
namespace {

std::string text_of(std::uint64_t value) {
  return std::to_string(value);
}

std::string text_of(double value) {
  return std::isnan(value) ? "NaN" : solver::exact_number(value);
}

/// Writes metrics in Prometheus' text format. Values of labels are fixed words, which need no
/// escaping.
class MetricText {
 public:
  void gauge(std::string_view name, std::string_view help) { family(name, "gauge", help); }
  void counter(std::string_view name, std::string_view help) { family(name, "counter", help); }

  /// Writes a value of the metric that was begun last. An example of `labels` is state="idle".
  template <typename Value>
  void sample(Value value, std::string_view labels = {}) {
    text_ += labels.empty() ? fmt::format("{} {}\n", name_, text_of(value))
                            : fmt::format("{}{{{}}} {}\n", name_, labels, text_of(value));
  }
  void histogram(std::string_view name, std::string_view help, const Histogram& values) {
    family(name, "histogram", help);
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < values.counts().size(); ++i) {
      count += values.counts()[i];
      const std::string bound =
          i < values.bounds().size() ? text_of(values.bounds()[i]) : std::string("+Inf");
      text_ += fmt::format("{}_bucket{{le=\"{}\"}} {}\n", name, bound, count);
    }
    text_ += fmt::format("{0}_sum {1}\n{0}_count {2}\n", name, text_of(values.sum()), count);
  }

  const std::string& text() const { return text_; }

 private:
  void family(std::string_view name, std::string_view type, std::string_view help) {
    name_ = name;
    text_ += fmt::format("# HELP {0} {1}\n# TYPE {0} {2}\n", name, help, type);
  }

  std::string text_;
  std::string name_;
};

void add_progress(MetricText& out, const Snapshot& now) {
  out.counter("oblique_points_solved_total", "Points whose solution was stored.");
  out.sample(now.points_solved);
  out.counter("oblique_points_failed_total", "Points that were stored as failed.");
  out.sample(now.points_failed);
  out.counter("oblique_results_ignored_total", "Results for another study, which were not stored.");
  out.sample(now.results_ignored);
  out.gauge("oblique_points_open", "Points of running studies without a result.");
  out.sample(now.points_open);
  out.gauge("oblique_points_leased", "Points leased to workers.");
  out.sample(now.points_leased);
  out.gauge("oblique_studies", "Studies in the database.");
  for (std::size_t i = 0; i < now.studies_by_state.size(); ++i) {
    out.sample(now.studies_by_state.at(i),
               fmt::format("state=\"{}\"", state_name(static_cast<StudyState>(i))));
  }
}

void add_workers(MetricText& out, const Snapshot& now) {
  const auto label = [](std::size_t i) {
    std::string state = kWorkerStates.at(i);
    std::ranges::replace(state, ' ', '_');
    return fmt::format("state=\"{}\"", state);
  };
  out.gauge("oblique_workers", "Workers.");
  for (std::size_t i = 0; i < now.groups.size(); ++i) {
    out.sample(now.groups.at(i).workers, label(i));
  }
  out.gauge("oblique_worker_threads", "Threads of workers.");
  for (std::size_t i = 0; i < now.groups.size(); ++i) {
    out.sample(now.groups.at(i).threads, label(i));
  }
  out.gauge("oblique_threads_wanted",
            "Number of threads that would solve the open points within a minute.");
  out.sample(now.threads_wanted());
}

void add_writer_and_disk(MetricText& out, const Snapshot& now, const DiskUsage& disk) {
  out.histogram("oblique_commit_duration_seconds", "Duration of a transaction.", now.commit_s);
  out.gauge("oblique_writer_queue_bytes", "Results that are not committed yet.");
  out.sample(now.writer_bytes);
  out.gauge("oblique_database_writable", "1: the database accepts results; 0: it does not.");
  out.sample(std::uint64_t{now.database_fault.empty() ? 1U : 0U});
  out.gauge("oblique_database_bytes", "Size of the database and of its write-ahead log.");
  out.sample(disk.database, "file=\"database\"");
  out.sample(disk.wal, "file=\"wal\"");
  out.gauge("oblique_disk_free_bytes", "Free space on the disk of the database.");
  out.sample(disk.free);
}

void add_requests(MetricText& out, const Snapshot& now,
                  const std::map<unsigned, std::uint64_t>& http_answers) {
  out.gauge("oblique_queries", "Queries of clients.");
  out.sample(now.queries.waiting, "state=\"waiting\"");
  out.sample(now.queries.running, "state=\"running\"");
  out.counter("oblique_http_requests_total", "HTTP requests that were answered.");
  for (const auto& [status, count] : http_answers) {
    out.sample(count, fmt::format("code=\"{}\"", status));
  }
  out.counter("oblique_peers_refused_total", "Peers that were refused or disconnected.");
  for (std::size_t i = 0; i < now.refusals.size(); ++i) {
    out.sample(now.refusals.at(i),
               fmt::format("cause=\"{}\"", name_of(static_cast<RefusalCause>(i))));
  }
}

}  // namespace

DiskUsage disk_usage(const std::string& database) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  std::error_code error;
  const auto bytes_of = [](const std::string& file, double if_missing) {
    std::error_code missing;
    const auto bytes = std::filesystem::file_size(file, missing);
    return missing ? if_missing : static_cast<double>(bytes);
  };
  const auto space =
      std::filesystem::space(std::filesystem::absolute(database, error).parent_path(), error);
  return {bytes_of(database, kUnknown), bytes_of(database + "-wal", 0.0),
          error ? kUnknown : static_cast<double>(space.available)};
}

std::string metrics_text(const MetricSources& sources) {
  MetricText out;
  add_progress(out, sources.snapshot);
  add_workers(out, sources.snapshot);
  add_writer_and_disk(out, sources.snapshot, sources.disk);
  add_requests(out, sources.snapshot, sources.http_answers);
  out.gauge("oblique_build_info", "Always 1.");
  out.sample(std::uint64_t{1}, fmt::format("version=\"{}\",solver_version=\"{}\"", OBLIQUE_VERSION,
                                           sources.solver_version));
  return out.text();
}

}  // namespace oblique::server
