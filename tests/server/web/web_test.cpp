// The whole server in this process, asked over HTTP while a pretended worker and client do things.
#include "server/web/web.h"

#include <memory>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/event_loop/running_server.h"
#include "tests/server/web/prometheus_text.h"
#include "tests/server/web/raw_http.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

WebSettings anywhere() {
  WebSettings settings;
  settings.address = {"127.0.0.1", "*"};
  settings.limits.longest = test::kHangLimit;
  settings.patience = test::kHangLimit;
  return settings;
}

class WebTest : public testing::Test {
 protected:
  std::map<std::string, ParsedMetric> metrics() const {
    const std::string answer = get(server_.http_url(), "/metrics");
    EXPECT_EQ(status_of_answer(answer), 200);
    EXPECT_THAT(answer,
                testing::HasSubstr("Content-Type: text/plain; version=0.0.4; charset=utf-8"));
    return parse_prometheus(body_of(answer));
  }

  test::TemporaryFolder folder_;
  RunningServer server_{folder_.file("a.db"), {}, {}, {}, {}, anywhere()};
};

TEST_F(WebTest, ShowsWhatWasDone) {
  PretendedClient client(server_.client_endpoint());
  client.submit("a", 20);
  PretendedWorker worker(server_.worker_endpoint());
  worker.hello();
  worker.work(20);
  auto now = metrics();  // which may be half a second old
  while (value_of(now, "oblique_points_solved_total") < 20.0) {
    now = metrics();
  }
  EXPECT_EQ(value_of(now, "oblique_points_solved_total"), 20.0);
  EXPECT_EQ(value_of(now, "oblique_points_open"), 0.0);
  EXPECT_EQ(value_of(now, "oblique_studies", {{"state", "done"}}), 1.0);
  EXPECT_EQ(value_of(now, "oblique_commit_rows_sum"), 20.0);
  EXPECT_GE(value_of(now, "oblique_commit_duration_seconds_count"), 1.0);
  EXPECT_GE(value_of(now, "oblique_batch_duration_seconds_count"), 1.0);
  EXPECT_EQ(value_of(now, "oblique_connections", {{"port", "workers"}}), 1.0);
  EXPECT_EQ(value_of(now, "oblique_connections", {{"port", "clients"}}), 1.0);
  EXPECT_GT(value_of(now, "oblique_received_bytes_total", {{"port", "workers"}}), 1000.0);
  EXPECT_GT(value_of(now, "oblique_sent_bytes_total", {{"port", "clients"}}), 0.0);
  EXPECT_GT(value_of(now, "oblique_database_bytes", {{"file", "database"}}), 0.0);
  EXPECT_EQ(value_of(now, "oblique_build_info",
                     {{"version", OBLIQUE_VERSION}, {"solver_version", "1.0"}}),
            1.0);
}

TEST_F(WebTest, SaysThatItLivesAndTakesWork) {
  EXPECT_EQ(body_of(get(server_.http_url(), "/healthz")), "the server runs\n");
  EXPECT_EQ(body_of(get(server_.http_url(), "/readyz")), "the server takes work\n");
}

TEST_F(WebTest, SaysWhatThereIs) {
  for (const std::string path : {"/metrics/", "/Metrics", "//metrics", "/../metrics", "*"}) {
    const std::string answer = get(server_.http_url(), path);
    EXPECT_EQ(status_of_answer(answer), 404) << path;
    EXPECT_THAT(answer, testing::HasSubstr("/metrics, /healthz and /readyz")) << path;
  }
}

TEST_F(WebTest, RefusesWhoWasLuredHere) {
  const std::string answer =
      RawHttp(server_.http_url()).ask("GET /metrics HTTP/1.1\r\nHost: evil.example\r\n\r\n");
  EXPECT_EQ(status_of_answer(answer), 403);
  EXPECT_THAT(answer, testing::Not(testing::HasSubstr("oblique_")));
}

TEST_F(WebTest, TwoHundredSlowConnectionsHoldUpNeitherWorkNorMetrics) {
  std::vector<std::unique_ptr<RawHttp>> slow;
  for (int i = 0; i < 200; ++i) {
    slow.push_back(std::make_unique<RawHttp>(server_.http_url()));
    slow.back()->send(i % 2 == 0 ? "G" : "GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n");
  }
  PretendedClient client(server_.client_endpoint());
  client.submit("a", 20);
  PretendedWorker worker(server_.worker_endpoint());
  worker.hello();
  worker.work(20);
  const std::map<std::string, std::string> crowded{{"cause", "crowded"}};
  while (value_of(metrics(), "oblique_http_ended_total", crowded) < 1.0) {
    // Numbers may be half a second old.
  }
  EXPECT_EQ(body_of(get(server_.http_url(), "/healthz")), "the server runs\n");
}

TEST_F(WebTest, EndsWithTheServerWhileSomeoneAsks) {
  RawHttp silent(server_.http_url());
  RawHttp asking(server_.http_url());
  asking.send("GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(server_.stop().lost_writes, 0U);
}

TEST(Web, AServerWithoutAPortOfItsOwnGoesOnOnlyIfItMay) {
  const test::TemporaryFolder folder;
  const RunningServer first(folder.file("a.db"), {}, {}, {}, {}, anywhere());
  WebSettings taken = anywhere();
  taken.address.port = first.http_url().substr(first.http_url().rfind(':') + 1);
  EXPECT_THROW(RunningServer(folder.file("b.db"), {}, {}, {}, {}, taken), std::runtime_error);
  taken.may_be_missing = true;
  const RunningServer second(folder.file("b.db"), {}, {}, {}, {}, taken);
  EXPECT_EQ(second.http_url(), "");
  EXPECT_EQ(PretendedClient(second.client_endpoint()).submit("a", 5).kind_case(),
            ClientReply::kSubmit);
}

TEST(Web, SaysThatTheLoopIsHeldUp) {
  WebSettings settings = anywhere();
  settings.patience = std::chrono::milliseconds(50);
  Web web(settings);
  const std::string metrics = get(web.url(), "/metrics");
  EXPECT_EQ(status_of_answer(metrics), 503);
  EXPECT_EQ(body_of(metrics), "the server has just begun\n");
  const std::string readiness = get(web.url(), "/readyz");
  EXPECT_EQ(status_of_answer(readiness), 503);
  EXPECT_EQ(body_of(readiness), "the server's loop is held up\n");
}

}  // namespace
}  // namespace oblique::server
