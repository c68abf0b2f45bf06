#include "server/web/metrics.h"

#include <fstream>
#include <limits>
#include <regex>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "server/web/health.h"
#include "tests/server/web/prometheus_text.h"

namespace oblique::server {
namespace {

using Metrics = std::map<std::string, ParsedMetric>;

Snapshot full_snapshot() {
  Snapshot snapshot;
  snapshot.points_open = 1000;
  snapshot.thread_s_per_point = 0.6;
  snapshot.listed = {{"paper \"μ\"", 1, 2, 3, 4, 0.5}, {"b", 0, 0, 0, 1, 0.0}};
  snapshot.open_by_key["lab"] = {2, 30};
  snapshot.batch_s = Histogram({1.0, 2.0});
  snapshot.batch_s.observe(1.5);
  snapshot.refusals.at(static_cast<std::size_t>(RefusalCause::kUnknownKey)) = 7;
  return snapshot;
}

Metrics metrics_of(const Snapshot& snapshot) {
  HttpCounts http;
  http.answers = {{200, 3}, {404, 1}};
  return parse_prometheus(
      metrics_text({snapshot, process_numbers(), {4096.0, 0.0, 1e9}, http, 0.1, 12.5, "1.0"}));
}

/// Of each row of the README's list: name, type and the names of labels.
std::map<std::string, std::pair<std::string, std::set<std::string>>> documented() {
  std::map<std::string, std::pair<std::string, std::set<std::string>>> rows;
  std::ifstream readme(OBLIQUE_WEB_README);
  const std::regex row(R"(\| `([a-z_]+)` \| (counter|gauge|histogram) \|([^|]*)\|.*)");
  const std::regex label("`([a-z_]+)`");
  for (std::string line; std::getline(readme, line);) {
    std::smatch found;
    if (std::regex_match(line, found, row)) {
      // Values stand in parentheses.
      const std::string labels = std::regex_replace(found[3].str(), std::regex(R"(\([^)]*\))"), "");
      std::set<std::string> names;
      for (std::sregex_iterator at(labels.begin(), labels.end(), label), end; at != end; ++at) {
        names.insert((*at)[1]);
      }
      EXPECT_TRUE(rows.emplace(found[1], std::pair(found[2].str(), names)).second) << found[1];
    }
  }
  return rows;
}

TEST(Metrics, AreThoseThatTheReadmeNames) {
  const auto rows = documented();
  const Metrics metrics = metrics_of(full_snapshot());
  for (const auto& [name, metric] : metrics) {
    ASSERT_TRUE(rows.contains(name)) << name << " is not in the README";
    EXPECT_EQ(rows.at(name).first, metric.type) << name;
    ASSERT_FALSE(metric.samples.empty()) << name;
    for (const ParsedSample& sample : metric.samples) {
      std::set<std::string> labels;
      for (const auto& [label, value] : sample.labels) {
        labels.insert(label);
      }
      labels.erase("le");
      EXPECT_EQ(rows.at(name).second, labels) << name;
    }
  }
  EXPECT_EQ(rows.size(), metrics.size()) << "the README names what is not written";
}

TEST(Metrics, ShowWhatTheSnapshotHas) {
  const Metrics metrics = metrics_of(full_snapshot());
  EXPECT_EQ(
      value_of(metrics, "oblique_study_points", {{"study", "paper \"μ\""}, {"state", "leased"}}),
      3.0);
  EXPECT_EQ(value_of(metrics, "oblique_peers_refused_total", {{"cause", "unknown key"}}), 7.0);
  EXPECT_EQ(value_of(metrics, "oblique_key_studies_open", {{"key", "lab"}}), 2.0);
  EXPECT_EQ(value_of(metrics, "oblique_key_points_open", {{"key", "lab"}}), 30.0);
  EXPECT_EQ(value_of(metrics, "oblique_batch_duration_seconds_sum"), 1.5);
  EXPECT_EQ(value_of(metrics, "oblique_threads_wanted"), 10.0);  // 1000 points of 0.6 s in 60 s
  EXPECT_EQ(value_of(metrics, "oblique_http_requests_total", {{"code", "404"}}), 1.0);
}

TEST(Metrics, TellOfThisProcess) {
  const Metrics metrics = metrics_of({});
  EXPECT_GT(value_of(metrics, "process_resident_memory_bytes"), 1e6);
  EXPECT_GT(value_of(metrics, "process_open_fds"), 2.0);
  EXPECT_GT(value_of(metrics, "process_start_time_seconds"), 1.5e9);
}

TEST(Metrics, ThreadsAreWantedForOpenPointsOnly) {
  Snapshot snapshot;
  EXPECT_EQ(snapshot.threads_wanted(), 0U);
  snapshot.points_open = 1'000'000'000;
  EXPECT_EQ(snapshot.threads_wanted(), 1U);  // no pace is known
  snapshot.thread_s_per_point = 1e-9;
  EXPECT_EQ(snapshot.threads_wanted(), 1U);
  snapshot.thread_s_per_point = 6e-3;
  EXPECT_EQ(snapshot.threads_wanted(), 100'000U);
  snapshot.thread_s_per_point = 1e300;
  EXPECT_EQ(snapshot.threads_wanted(), 1'000'000'000U);
}

TEST(Health, IsThatTheLoopStates) {
  EXPECT_EQ(health(1000, 1000).status, 200U);
  EXPECT_EQ(health(1000, 6000).status, 200U);
  EXPECT_EQ(health(1000, 8500).status, 503U);
  EXPECT_EQ(health(1000, 8500).body, "the server's loop has not turned for 7.5 s\n");
}

TEST(Health, ReadinessSaysWhatIsMissing) {
  constexpr double kPlenty = 1e12;
  EXPECT_EQ(readiness({}, kPlenty).status, 200U);
  EXPECT_EQ(readiness({}, std::numeric_limits<double>::quiet_NaN()).status, 200U);  // unknown
  Snapshot faulty;
  faulty.database_fault = "disk I/O error\n\x1b[2J";
  EXPECT_EQ(readiness(faulty, kPlenty).status, 503U);
  EXPECT_EQ(readiness(faulty, kPlenty).body,
            "the database takes no results: disk I/O error\\n\\x1b[2J\n");
  Snapshot stopping;
  stopping.is_stopping = true;
  EXPECT_EQ(readiness(stopping, kPlenty).status, 503U);
  EXPECT_EQ(readiness({}, 1e6).body, "the database's disk has 1 MB left\n");
}

}  // namespace
}  // namespace oblique::server
