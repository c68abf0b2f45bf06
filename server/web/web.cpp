#include "server/web/web.h"

#include <chrono>
#include <memory>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "server/web/status/metrics.h"
#include "worker/solver/model/number.h"

namespace oblique::server {
namespace {

constexpr std::int64_t kSnapshotInterval_ms = 500;
constexpr std::int64_t kLongestTurn_ms = 5000;
/// With less room than this a server is not ready; 80 000 results take it.
constexpr double kLeastFree_bytes = 64.0 * 1024 * 1024;

std::int64_t steady_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

PageSettings page_settings_of(const WebSettings& settings) {
  PageSettings page = settings.page;
  page.database = settings.database;
  page.version = OBLIQUE_VERSION;
  return page;
}

}  // namespace

HttpAnswer health(std::int64_t made_ms, std::int64_t now_ms) {
  const std::int64_t age_ms = now_ms - made_ms;
  if (age_ms <= kLongestTurn_ms) {
    return text_answer(MHD_HTTP_OK, "the server runs");
  }
  return text_answer(MHD_HTTP_SERVICE_UNAVAILABLE,
                     fmt::format("the server's event loop has not run for {} s",
                                 solver::fixed_number(1e-3 * static_cast<double>(age_ms), 1)));
}

HttpAnswer readiness(const Snapshot& snapshot, double free_bytes) {
  if (snapshot.is_stopping) {
    return text_answer(MHD_HTTP_SERVICE_UNAVAILABLE, "the server stops and hands out nothing");
  }
  if (!snapshot.database_fault.empty()) {
    return text_answer(
        MHD_HTTP_SERVICE_UNAVAILABLE,
        "the database takes no results: " + protocol::visible(snapshot.database_fault));
  }
  if (free_bytes < kLeastFree_bytes) {
    return text_answer(MHD_HTTP_SERVICE_UNAVAILABLE,
                       fmt::format("the database's disk has {} MB left",
                                   solver::fixed_number(1e-6 * free_bytes, 0)));
  }
  return text_answer(MHD_HTTP_OK, "the server takes work");
}

Web::Web(WebSettings settings)
    : settings_(std::move(settings)),
      started_ms_(steady_ms()),
      page_(page_settings_of(settings_), service_, events_),
      http_(settings_.address, {is_loopback(settings_.address.address), settings_.names},
            settings_.limits,
            {[this](const HttpRequest& request) { return answer(request); },
             [this](const HttpRequest& request) { return page_.refuse_change(request); }}) {}

bool Web::put_reply(const std::string& frame) {
  service_.put(frame);
  http_.wake();
  return true;
}

void Web::tick(const SnapshotSources& sources, std::int64_t now_ms) {
  if (now_ms - published_ms_ >= kSnapshotInterval_ms) {
    published_ms_ = now_ms;
    snapshots_.publish(take_snapshot(sources, now_ms));
    http_.wake();
  }
}

HttpOutcome Web::answer(const HttpRequest& request) {
  if (auto outcome = page_.answer(request)) {
    return *std::move(outcome);
  }
  const std::string& path = request.path;
  if (path != "/healthz" && path != "/readyz" && path != "/metrics") {
    return text_answer(MHD_HTTP_NOT_FOUND, "there are a page at /, /metrics, /healthz and /readyz");
  }
  const auto snapshot = snapshots_.latest();
  HttpAnswer alive = health(snapshot ? snapshot->made_ms : started_ms_, steady_ms());
  if (alive.status != MHD_HTTP_OK || path == "/healthz") {
    return alive;
  }
  if (!snapshot) {
    return text_answer(MHD_HTTP_SERVICE_UNAVAILABLE, "the server is starting");
  }
  const DiskUsage disk = disk_usage(settings_.database);
  if (path == "/readyz") {
    return readiness(*snapshot, disk.free);
  }
  return HttpAnswer{MHD_HTTP_OK, "text/plain; version=0.0.4; charset=utf-8",
                    metrics_text({*snapshot, disk, http_.answers(), settings_.solver_version})};
}

}  // namespace oblique::server
