#include "server/web/web.h"

#include <chrono>
#include <memory>
#include <stdexcept>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "proto/text.h"
#include "server/network/listener.h"
#include "server/web/http/request_rules.h"
#include "worker/solver/model/number.h"

namespace oblique::server {
namespace {

constexpr std::int64_t kSnapshotInterval_ms = 500;
constexpr std::int64_t kLongestTurn_ms = 5000;
/// Minimum free space of a disk. With less the server is not ready; 80 000 results need this space.
constexpr double kLeastFree_bytes = 64.0 * 1024 * 1024;

std::int64_t steady_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace

void HttpOptions::add_to(CLI::App& app) {
  address_option_ =
      app.add_option("--http", address_,
                     "Address and port of the page, metrics and health over HTTP; port 0: "
                     "chosen by the system; off: no HTTP")
          ->type_name("ADDRESS:PORT");
  app.add_option("--http-name", names_,
                 "Further host name of this server, besides numeric addresses and localhost; may "
                 "be repeated")
      ->type_name("HOST");
  app.add_flag("--http-read-without-token", shows_without_token_,
               "Show the page without a token; changes still need it");
  app.add_option(
         "--http-token-file", token_file_,
         "File with the token of the page, 32 to 128 letters and digits, created if it does not "
         "exist; without it each start creates a random token")
      ->type_name("FILE");
}

std::optional<WebSettings> HttpOptions::settings() const {
  WebSettings settings;
  for (const std::string& name : names_) {
    const std::string lower = CLI::detail::to_lower(name);
    if (lower.empty() || host_without_port(lower) != lower) {
      throw std::runtime_error(
          fmt::format("--http-name {} is not a host name, as oblique.example.org, without a port",
                      protocol::visible(name)));
    }
    settings.names.insert(lower);
  }
  const auto address = parse_http_address(address_);
  if (!address) {
    return std::nullopt;
  }
  settings.address = *address;
  settings.page.shows_without_token = shows_without_token_;
  if (!token_file_.empty()) {
    settings.page.token = PageToken::from_file(token_file_);
  }
  // If the default port is in use, for example by a second server, the server runs without HTTP.
  settings.may_be_missing = address_option_->count() == 0;
  return settings;
}

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
    return text_answer(MHD_HTTP_SERVICE_UNAVAILABLE, "the server is stopping and sends no batches");
  }
  if (!snapshot.database_fault.empty()) {
    return text_answer(
        MHD_HTTP_SERVICE_UNAVAILABLE,
        "the database accepts no results: " + protocol::visible(snapshot.database_fault));
  }
  if (free_bytes < kLeastFree_bytes) {
    return text_answer(MHD_HTTP_SERVICE_UNAVAILABLE,
                       fmt::format("the disk of the database has {} MB left",
                                   solver::fixed_number(1e-6 * free_bytes, 0)));
  }
  return text_answer(MHD_HTTP_OK, "the server accepts work");
}

Web::Web(WebSettings settings)
    : settings_(std::move(settings)),
      started_ms_(steady_ms()),
      page_(settings_.page, settings_.database, service_, snapshots_),
      http_(settings_.address,
            {is_loopback(settings_.address.address).value_or(false), settings_.names},
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
    return text_answer(
        MHD_HTTP_NOT_FOUND,
        "unknown path: this server has the page at /, /metrics, /healthz and /readyz");
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
