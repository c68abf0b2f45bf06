// Tests of snapshots, metrics and health, with and without a whole server.
#include "server/web/web.h"

#include <array>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <map>
#include <regex>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/web/status/snapshot.h"
#include "tests/server/event_loop/running_server.h"
#include "tests/server/service/service_fixture.h"
#include "tests/server/web/raw_http.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

/// A storage that accepts every write.
class TakingStorage final : public Storage {
 public:
  void commit(std::span<const Change> /*changes*/) override {}
  void check() override {}
  bool merge_log() override { return true; }
};

class SnapshotTest : public ServiceTest {
 protected:
  Snapshot snapshot() { return take_snapshot({*service_, network_, writer_}, now_.steady_ms); }
  void submit(const std::string& name, std::uint64_t points, std::int32_t priority = 0) {
    ClientRequest message = submit_request(name, points);
    message.mutable_submit()->set_priority(priority);
    request(message);
    write_all();
  }
  static std::uint64_t workers(const Snapshot& snapshot, WorkerState state) {
    return snapshot.groups.at(static_cast<std::size_t>(state)).workers;
  }

  Network network_{NetworkLimits{}};
  TakingStorage storage_;
  Writer writer_{storage_, [](const auto&) {}};
};

TEST_F(SnapshotTest, FollowsThePointsOfAStudy) {
  submit("a", 100);
  EXPECT_EQ(snapshot().points_open, 100U);
  EXPECT_EQ(snapshot().points_leased, 0U);
  hello();
  EXPECT_EQ(workers(snapshot(), WorkerState::kIdle), 1U);
  credit(1);
  const std::vector<std::uint64_t> points = points_of(last_message().batch());
  const std::uint64_t leased = points.size();
  EXPECT_EQ(snapshot().points_leased, leased);
  EXPECT_EQ(workers(snapshot(), WorkerState::kWorking), 1U);
  now_.steady_ms += 700;
  answer_batch(points.back());  // reports the last point as failed
  const Snapshot after = snapshot();
  EXPECT_EQ(after.points_solved, leased - 1);
  EXPECT_EQ(after.points_failed, 1U);
  EXPECT_EQ(after.points_open, 100 - leased);
  ASSERT_EQ(after.studies.size(), 1U);
  EXPECT_EQ(after.studies[0].solved(), leased - 1);
  EXPECT_EQ(after.studies[0].failed(), 1U);
  ASSERT_EQ(after.workers.size(), 1U);
  EXPECT_EQ(after.workers[0].solved_points(), leased - 1);
  EXPECT_GT(after.points_per_s, 0.0);
}

TEST_F(SnapshotTest, CountsAWorkerOnce) {
  hello("one");
  hello("other");
  now_.steady_ms += 2500;
  credit(1, "one");
  EXPECT_EQ(workers(snapshot(), WorkerState::kSilent), 1U);
  EXPECT_EQ(workers(snapshot(), WorkerState::kIdle), 1U);
}

TEST_F(SnapshotTest, CountsOnlyRunningStudiesAsOpen) {
  submit("runs", 10);
  submit("paused", 20);
  submit("cancelled", 40);
  request(change_request("paused", protocol::STUDY_CHANGE_PAUSE));
  request(cancel_request("cancelled"));
  write_all();
  const Snapshot now = snapshot();
  EXPECT_EQ(now.points_open, 10U);
  EXPECT_EQ(now.studies_by_state.at(static_cast<std::size_t>(StudyState::kPaused)), 1U);
  EXPECT_EQ(now.studies_by_state.at(static_cast<std::size_t>(StudyState::kCancelled)), 1U);
  ASSERT_EQ(now.studies.size(), 2U);
  EXPECT_EQ(now.studies[1].name(), "paused");
}

TEST_F(SnapshotTest, ListsTheFiftyStudiesOfTheHighestPriority) {
  for (int i = 0; i < 120; ++i) {
    submit("study " + std::to_string(i), 10, i == 100 ? 5 : 0);
  }
  const Snapshot now = snapshot();
  ASSERT_EQ(now.studies.size(), kShownStudies);
  EXPECT_EQ(now.unlisted, 70U);
  EXPECT_EQ(now.points_open, 1200U);
  EXPECT_EQ(now.studies.front().name(), "study 100");
  EXPECT_EQ(now.studies[1].name(), "study 0");
  EXPECT_EQ(now.studies.back().name(), "study 48");
}

TEST_F(SnapshotTest, LeavesOutAStudyThatIsNotDurable) {
  request(submit_request("a", 10));
  EXPECT_TRUE(snapshot().studies.empty());
  write_all("disk full");
  EXPECT_EQ(snapshot().studies_by_state, (std::array<std::uint64_t, kStudyStates>{}));
}

TEST_F(SnapshotTest, ShowsWhyNothingIsStoredAndHowManyQueriesWait) {
  for (std::uint64_t id = 1; id <= 2; ++id) {
    ClientRequest message = client_request(id);
    message.mutable_query()->set_sql("SELECT 1");
    request(message);
  }
  service_->query_report({QueryReport::Kind::kBegun, ports_.queries.at(0).ticket, {}});
  EXPECT_EQ(snapshot().queries.waiting, 1U);
  EXPECT_EQ(snapshot().queries.running, 1U);
  service_->written({WriteReport::Kind::kFault, 0, "disk full"}, now_);
  EXPECT_EQ(snapshot().database_fault, "disk full");
  service_->stop(now_);
  EXPECT_TRUE(snapshot().is_stopping);
}

TEST(Snapshot, WantsThreadsForOpenPointsOnly) {
  Snapshot snapshot;
  EXPECT_EQ(snapshot.threads_wanted(), 0U);
  snapshot.points_open = 1'000'000'000;
  EXPECT_EQ(snapshot.threads_wanted(), 1U);  // one thread, because the time per point is unknown
  snapshot.thread_s_per_point = 1e-9;
  EXPECT_EQ(snapshot.threads_wanted(), 1U);
  snapshot.thread_s_per_point = 6e-3;
  EXPECT_EQ(snapshot.threads_wanted(), 100'000U);
  snapshot.thread_s_per_point = 1e300;
  EXPECT_EQ(snapshot.threads_wanted(), 1'000'000'000U);
}

// ---- Metrics and health -------------------------------------------------------------------------

struct Metrics {
  std::map<std::string, std::string> types;
  std::map<std::string, double> values;  ///< keys: names of metrics with their labels, as printed
};

Metrics parse(const std::string& text) {
  static const std::regex kLine(
      R"re(# HELP [a-z_]+ .+|# TYPE ([a-z_]+) (gauge|counter|histogram)|)re"
      R"re(([a-z_]+(?:\{[a-z_]+="[^"\\]*"(?:,[a-z_]+="[^"\\]*")*\})?) (NaN|[0-9.e+-]+))re");
  Metrics metrics;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::smatch found;
    EXPECT_TRUE(std::regex_match(line, found, kLine)) << line;
    if (found[1].matched) {
      EXPECT_TRUE(metrics.types.emplace(found[1], found[2]).second) << line;
      EXPECT_EQ(found[1].str().ends_with("_total"), found[2] == "counter") << line;
    } else if (found[3].matched) {
      const double value = std::strtod(found[4].str().c_str(), nullptr);
      EXPECT_TRUE(metrics.values.emplace(found[3], value).second) << line;
    }
  }
  return metrics;
}

Metrics metrics_of(const Snapshot& snapshot) {
  return parse(metrics_text({snapshot, {4096.0, 0.0, 1e9}, {{200, 3}, {404, 1}}, "1.0"}));
}

TEST(Metrics, AreTheOnesInTheReadme) {
  std::map<std::string, std::string> listed;
  std::ifstream readme(OBLIQUE_WEB_README);
  const std::regex row(R"(\| `([a-z_]+)` \| (counter|gauge|histogram) \|.*)");
  for (std::string line; std::getline(readme, line);) {
    std::smatch found;
    if (std::regex_match(line, found, row)) {
      listed.emplace(found[1], found[2]);
    }
  }
  EXPECT_EQ(metrics_of({}).types, listed);
}

TEST(Metrics, ShowTheSnapshot) {
  Snapshot snapshot;
  snapshot.points_open = 1000;
  snapshot.thread_s_per_point = 0.6;
  snapshot.commit_s = Histogram({0.1, 1.0});
  for (const double duration_s : {0.05, 0.1, 0.5, 2.0}) {
    snapshot.commit_s.observe(duration_s);
  }
  snapshot.refusals.at(static_cast<std::size_t>(RefusalCause::kUnknownKey)) = 7;
  snapshot.database_fault = "disk I/O error";
  auto values = metrics_of(snapshot).values;
  EXPECT_EQ(values["oblique_threads_wanted"], 10.0);  // 1000 points of 0.6 s within 60 s
  EXPECT_EQ(values["oblique_commit_duration_seconds_bucket{le=\"0.1\"}"], 2.0);
  EXPECT_EQ(values["oblique_commit_duration_seconds_bucket{le=\"1\"}"], 3.0);
  EXPECT_EQ(values["oblique_commit_duration_seconds_bucket{le=\"+Inf\"}"], 4.0);
  EXPECT_EQ(values["oblique_commit_duration_seconds_sum"], 2.65);
  EXPECT_EQ(values["oblique_commit_duration_seconds_count"], 4.0);
  EXPECT_EQ(values["oblique_peers_refused_total{cause=\"unknown key\"}"], 7.0);
  EXPECT_EQ(values["oblique_database_writable"], 0.0);
  EXPECT_EQ(values["oblique_database_bytes{file=\"database\"}"], 4096.0);
  EXPECT_EQ(values["oblique_http_requests_total{code=\"404\"}"], 1.0);
}

TEST(Health, IsGoodWhileTheEventLoopRuns) {
  EXPECT_EQ(health(1000, 6000).status, 200U);
  EXPECT_EQ(health(1000, 8500).status, 503U);
  EXPECT_EQ(health(1000, 8500).body, "the server's event loop has not run for 7.5 s\n");
}

TEST(Health, ReadinessGivesTheReasonIfTheServerIsNotReady) {
  constexpr double kPlenty = 1e12;
  EXPECT_EQ(readiness({}, kPlenty).status, 200U);
  EXPECT_EQ(readiness({}, std::numeric_limits<double>::quiet_NaN()).status, 200U);  // unknown
  Snapshot faulty;
  faulty.database_fault = "disk I/O error\n\x1b[2J";
  EXPECT_EQ(readiness(faulty, kPlenty).status, 503U);
  EXPECT_EQ(readiness(faulty, kPlenty).body,
            "the database accepts no results: disk I/O error\\n\\x1b[2J\n");
  Snapshot stopping;
  stopping.is_stopping = true;
  EXPECT_EQ(readiness(stopping, kPlenty).status, 503U);
  EXPECT_EQ(readiness({}, 1e6).body, "the disk of the database has 1 MB left\n");
}

WebSettings at_free_port() {
  WebSettings settings;
  settings.address = {"127.0.0.1", "*"};
  settings.limits.idle = test::kHangLimit;
  return settings;
}

TEST(Web, ReportsThatTheServerStartsBeforeTheLoopRuns) {
  const Web web(at_free_port());
  EXPECT_EQ(body_of(get(web.url(), "/healthz")), "the server runs\n");
  for (const std::string path : {"/metrics", "/readyz"}) {
    const std::string answer = get(web.url(), path);
    EXPECT_EQ(status_of_answer(answer), 503) << path;
    EXPECT_EQ(body_of(answer), "the server is starting\n") << path;
  }
}

class WebTest : public testing::Test {
 protected:
  /// Waits until the server has started; then returns its answer.
  std::string get_started(const std::string& path) const {
    std::string answer = get(server_.http_url(), path);
    while (body_of(answer) == "the server is starting\n") {
      answer = get(server_.http_url(), path);
    }
    return answer;
  }

  test::TemporaryFolder folder_;
  RunningServer server_{folder_.file("a.db"), {}, {}, {}, {}, at_free_port()};
};

TEST_F(WebTest, MetricsFollowTheServer) {
  SimulatedClient(server_.client_endpoint()).submit("a", 20);
  SimulatedWorker worker(server_.worker_endpoint());
  worker.hello();
  worker.work(20);
  EXPECT_THAT(get_started("/metrics"),
              testing::HasSubstr("Content-Type: text/plain; version=0.0.4; charset=utf-8"));
  const auto values = [this] { return parse(body_of(get_started("/metrics"))).values; };
  auto now = values();  // the server updates these values twice a second
  while (now["oblique_points_solved_total"] < 20.0) {
    now = values();
  }
  EXPECT_EQ(now["oblique_studies{state=\"done\"}"], 1.0);
  EXPECT_GE(now["oblique_commit_duration_seconds_count"], 1.0);
  EXPECT_GT(now["oblique_database_bytes{file=\"database\"}"], 0.0);
  EXPECT_GT(now["oblique_disk_free_bytes"], 0.0);
  EXPECT_EQ(now["oblique_build_info{version=\"" + std::string(OBLIQUE_VERSION) +
                "\",solver_version=\"1.0\"}"],
            1.0);
}

TEST_F(WebTest, ErrorsNameThePaths) {
  EXPECT_EQ(body_of(get(server_.http_url(), "/healthz")), "the server runs\n");
  EXPECT_EQ(body_of(get_started("/readyz")), "the server accepts work\n");
  for (const std::string path : {"/metrics/", "/Metrics", "//metrics", "/../metrics", "*"}) {
    const std::string answer = get(server_.http_url(), path);
    EXPECT_EQ(status_of_answer(answer), 404) << path;
    EXPECT_THAT(answer, testing::HasSubstr("/metrics, /healthz and /readyz")) << path;
  }
}

TEST(Web, AServerRunsWithoutHttpOnlyIfHttpIsOptional) {
  const test::TemporaryFolder folder;
  const RunningServer first(folder.file("a.db"), {}, {}, {}, {}, at_free_port());
  WebSettings taken = at_free_port();
  taken.address.port = first.http_url().substr(first.http_url().rfind(':') + 1);
  EXPECT_THAT([&] { RunningServer(folder.file("b.db"), {}, {}, {}, {}, taken); },
              testing::ThrowsMessage<std::runtime_error>(
                  testing::HasSubstr("127.0.0.1:" + taken.address.port)));
  taken.may_be_missing = true;
  const RunningServer second(folder.file("b.db"), {}, {}, {}, {}, taken);
  EXPECT_EQ(second.http_url(), "");
  EXPECT_EQ(SimulatedClient(second.client_endpoint()).submit("a", 5).kind_case(),
            ClientReply::kSubmit);
}

}  // namespace
}  // namespace oblique::server
