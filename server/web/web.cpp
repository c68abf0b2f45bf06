#include "server/web/web.h"

#include <chrono>
#include <optional>
#include <utility>

#include "server/web/health.h"
#include "server/web/metric_text.h"
#include "server/web/metrics.h"
#include "server/web/notice_board.h"
#include "server/web/overview.h"
#include "server/web/page/live_text.h"
#include "server/web/process_numbers.h"

namespace oblique::server {
namespace {

constexpr unsigned kNotFound = 404;
constexpr unsigned kServiceUnavailable = 503;

WebSettings with_version(WebSettings settings) {
  settings.page.version = OBLIQUE_VERSION;
  settings.page.database = settings.database;
  return settings;
}

constexpr const char* kPlainText = "text/plain; charset=utf-8";

std::int64_t steady_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace

class Web::Parts {
 public:
  explicit Parts(WebSettings settings)
      : settings_(with_version(std::move(settings))),
        http_(settings_.address, {is_loopback(settings_.address.address), settings_.names},
              settings_.limits,
              [this](const HttpServer::Question& question) { return answer(question); },
              {&Page::takes_changes,
               [this](const HttpServer::Question& question) {
                 return page_.objection_to_change(question);
               },
               [this](std::uint64_t number) { page_.gone(number); }}) {}

  std::string url() const { return http_.url(); }
  std::string page_url() const { return url() + "/?token=" + page_.key().token(); }

  int descriptor() const { return line_.descriptor(); }
  std::vector<std::string> take_requests() { return line_.take(); }
  void put_reply(const std::string& frame) {
    line_.put(frame);
    http_.wake();
  }

  void tick(const SnapshotSources& sources, std::int64_t now_ms) {
    board_.turned(now_ms);
    if (board_.is_due(now_ms) && board_.put(take_snapshot(sources, now_ms, board_.is_for_page()))) {
      http_.wake();
    }
  }

 private:
  std::optional<HttpAnswer> answer(const HttpServer::Question& question) {
    if (question.path == "/healthz") {
      return health(board_.turned_ms(), steady_ms());
    }
    if (Page::has(question.path)) {
      return page_.answer(question);
    }
    const bool wants_metrics = question.path == "/metrics";
    if (!wants_metrics && question.path != "/readyz") {
      return HttpAnswer{kNotFound, kPlainText,
                        "there are a page at /, /metrics, /healthz and /readyz\n"};
    }
    const NoticeBoard::Shared latest = board_.latest();
    const std::int64_t asked_ms = steady_ms() - question.waited.count();
    const bool is_recent = latest && latest->made_ms >= asked_ms - NoticeBoard::kPause_ms;
    if (!is_recent && question.waited < settings_.patience) {
      board_.want();
      return std::nullopt;
    }
    if (!is_recent && !wants_metrics) {
      return HttpAnswer{kServiceUnavailable, kPlainText, "the server's loop is held up\n"};
    }
    if (!latest) {
      return HttpAnswer{kServiceUnavailable, kPlainText, "the server has just begun\n"};
    }
    return wants_metrics ? metrics(latest, *question.counts)
                         : readiness(*latest, disk_numbers(settings_.database).free_bytes);
  }

  /// The overview, where it is another one than at the last look; asks for the next.
  std::optional<std::string> look() {
    const NoticeBoard::Shared latest = board_.latest();
    board_.want_for_page();
    if (!latest || latest == told_ || !latest->is_for_page) {
      return std::nullopt;
    }
    told_ = latest;
    std::string overview = overview_json(*latest);
    return overview == std::exchange(overview_, overview) ? std::nullopt : std::optional(overview);
  }

  /// Written once for each snapshot, however often it is asked for.
  HttpAnswer metrics(const NoticeBoard::Shared& snapshot, const HttpCounts& counts) {
    if (snapshot != shown_) {
      const std::int64_t now_ms = steady_ms();
      const auto seconds_since = [now_ms](std::int64_t then_ms) {
        return 1e-3 * static_cast<double>(now_ms - then_ms);
      };
      text_ = metrics_text({*snapshot, process_numbers(), disk_numbers(settings_.database), counts,
                            seconds_since(board_.turned_ms()), seconds_since(began_ms_),
                            settings_.solver_version});
      shown_ = snapshot;
    }
    return {200, MetricText::kContentType, text_};
  }

  WebSettings settings_;
  std::int64_t began_ms_ = steady_ms();
  NoticeBoard board_{began_ms_};
  NoticeBoard::Shared shown_;  // of the HTTP server's thread
  std::string text_;           // the same
  NoticeBoard::Shared told_;   // the same
  std::string overview_;       // the same
  ServiceClient line_;
  LiveText live_{[this] { return look(); }, began_ms_};
  Page page_{settings_.page, {line_, live_}};
  HttpServer http_;  // last: its thread uses all the others
};

Web::Web(WebSettings settings) : parts_(std::make_unique<Parts>(std::move(settings))) {}
Web::~Web() = default;

std::string Web::url() const {
  return parts_->url();
}

std::string Web::page_url() const {
  return parts_->page_url();
}

int Web::descriptor() const {
  return parts_->descriptor();
}

bool Web::is_client(const std::string& identity) {
  return identity == ServiceClient::kIdentity;
}

std::vector<std::string> Web::take_requests() {
  return parts_->take_requests();
}

bool Web::put_reply(const std::string& frame) {
  parts_->put_reply(frame);
  return true;
}

void Web::tick(const SnapshotSources& sources, std::int64_t now_ms) {
  parts_->tick(sources, now_ms);
}

}  // namespace oblique::server
