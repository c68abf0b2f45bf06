#include "server/web/page/page.h"

#include <algorithm>
#include <regex>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <chrono>

#include "server/web/answers/fields.h"
#include "server/web/answers/study_answers.h"

namespace oblique::server {
namespace {

constexpr std::chrono::seconds kKeepAlive{15};

constexpr std::string_view kApi = "/api/";
constexpr std::string_view kStudies = "/api/studies";
constexpr std::string_view kCheck = "/api/check";

constexpr const char* kHowToEnter =
    "the page needs the token of this server: open the address that the server printed when "
    "it started, or the one that `oblique view` prints";

/// /api/studies/STUDY[/points/POINT][/PART]
struct StudyPath {
  std::uint64_t study = 0;
  std::optional<std::uint64_t> point;
  std::string part;
};

std::optional<StudyPath> parse_study_path(const std::string& path) {
  static const std::regex kPath(
      "/api/studies/([1-9][0-9]{0,18})(?:/points/([0-9]{1,19}))?(?:/([a-z]{1,20}))?");
  std::smatch found;
  if (!std::regex_match(path, found, kPath)) {
    return std::nullopt;
  }
  StudyPath parsed{std::stoull(found[1]), {}, found[3]};
  if (found[2].matched) {
    parsed.point = std::stoull(found[2]);
  }
  return parsed;
}

std::optional<std::pair<std::uint64_t, protocol::StudyChange>> parse_change(
    const std::string& path) {
  const auto parsed = parse_study_path(path);
  const auto change = parsed && !parsed->point ? study_change(parsed->part) : std::nullopt;
  return change ? std::optional(std::pair(parsed->study, *change)) : std::nullopt;
}

/// Returns whether an Accept-Encoding of the request names gzip without q=0.
bool accepts_gzip(const HttpRequest& request) {
  static const std::regex kGzip(R"(.*\bgzip\s*(?!\s*;\s*q=0(\.0*)?\s*(,|$))(;.*|,.*|$))",
                                std::regex::icase);
  const auto codings = request.all("accept-encoding");
  return std::ranges::any_of(codings,
                             [](const std::string& text) { return std::regex_match(text, kGzip); });
}

/// Returns the file at the request's path (/ is the page), or 304 if the browser has the file
/// already. Returns nothing if there is no such file.
std::optional<HttpAnswer> file_answer(const HttpRequest& request) {
  const auto files = page_files();
  const auto file = std::ranges::find_if(files, [&](const PageFile& one) {
    return one.path == (request.path == "/" ? "/index.html" : request.path);
  });
  if (file == files.end()) {
    return std::nullopt;
  }
  // The browser caches the file, but checks each time whether the file has changed.
  HttpAnswer answer{MHD_HTTP_OK,
                    std::string(file->content_type),
                    {},
                    {{"ETag", std::string(file->tag)},
                     {"Cache-Control", "no-cache"},
                     {"Vary", "Accept-Encoding"}}};
  if (request.header("if-none-match").find(file->tag) != std::string::npos) {
    answer.status = MHD_HTTP_NOT_MODIFIED;
  } else if (accepts_gzip(request)) {
    answer.headers.emplace_back("Content-Encoding", "gzip");
    answer.body.assign(file->gzipped.begin(), file->gzipped.end());
  } else {
    answer.body.assign(file->plain.begin(), file->plain.end());
  }
  return answer;
}

}  // namespace

Page::Page(PageSettings settings, std::string database, ServiceClient& service,
           const SnapshotCache& snapshots)
    : settings_(std::move(settings)),
      database_(std::move(database)),
      service_(service),
      events_(snapshots) {}

bool Page::is_trusted(const HttpRequest& request) const {
  return token().is_in(request.all("cookie"), request.header("host"));
}

std::optional<HttpAnswer> Page::refuse_change(const HttpRequest& request) const {
  const std::string& path = request.path;
  if (path != kStudies && path != kCheck && !parse_change(path)) {
    return error_answer(MHD_HTTP_METHOD_NOT_ALLOWED, "this path accepts no POST");
  }
  return is_trusted(request) ? std::nullopt
                             : std::optional(error_answer(MHD_HTTP_UNAUTHORIZED, kHowToEnter));
}

/// Exchanges the token for a cookie, which keeps the token out of the browser's history.
HttpAnswer Page::enter(const HttpRequest& request) const {
  if (!token().is(request.fields.at("token"))) {
    return text_answer(MHD_HTTP_FORBIDDEN,
                       "that is not the token of this server, which may create a new one when it "
                       "starts");
  }
  HttpAnswer answer = text_answer(MHD_HTTP_SEE_OTHER, "");
  answer.headers = {{"Location", "./"}, {"Set-Cookie", token().cookie_for(request.header("host"))}};
  return answer;
}

HttpAnswer Page::session(const HttpRequest& request) const {
  const bool trusted = is_trusted(request);
  return json_answer({{"version", OBLIQUE_VERSION},
                      {"may_look", trusted || settings_.shows_without_token},
                      {"may_change", trusted},
                      {"file", trusted && settings_.is_of_file ? database_ : ""},
                      {"how_to_enter", trusted ? "" : kHowToEnter}});
}

std::optional<HttpOutcome> Page::answer(const HttpRequest& request) {
  if (request.path == "/" && request.fields.contains("token")) {
    return enter(request);
  }
  if (!request.path.starts_with(kApi)) {
    return file_answer(request);
  }
  if (request.path == "/api/session") {
    return session(request);
  }
  if (!settings_.shows_without_token && !is_trusted(request)) {
    return error_answer(MHD_HTTP_UNAUTHORIZED, kHowToEnter);
  }
  if (!is_text(request.fields)) {
    return error_answer(MHD_HTTP_BAD_REQUEST, "fields of a request must be UTF-8");
  }
  auto outcome = request.method == "POST" ? change(request) : read(request);
  return outcome ? std::move(outcome)
                 : error_answer(MHD_HTTP_NOT_FOUND, "there is nothing at this path");
}

std::optional<HttpOutcome> Page::read(const HttpRequest& request) {
  if (request.path == "/api/events") {
    HttpAnswer answer{200, "text/event-stream", {}};
    answer.stream = events_.subscribe(request.header("last-event-id"));
    return answer;
  }
  if (request.path == kStudies) {
    return list_studies(service_, request.fields);
  }
  if (request.path == "/api/workers") {
    return list_workers(service_, request.fields);
  }
  const auto path = parse_study_path(request.path);
  if (!path) {
    return std::nullopt;
  }
  const auto& [study, point, part] = *path;
  if (point && part.empty()) {
    return point_answer(service_, study, *point);
  }
  if (point) {
    return part == "trace"
               ? std::optional<HttpOutcome>(solve_trace(service_, study, *point, request.fields))
               : std::nullopt;
  }
  if (part.empty()) {
    return study_answer(service_, study);
  }
  if (part == "slice") {
    return slice_answer(service_, study, request.fields);
  }
  if (part == "bins") {
    return bins_answer(service_, study, request.fields);
  }
  if (part == "rows") {
    return query_rows(service_, study, request.fields);
  }
  return std::nullopt;
}

std::optional<HttpOutcome> Page::change(const HttpRequest& request) {
  if (request.path == kStudies) {
    return submit_study(service_, request.body);
  }
  if (request.path == kCheck) {
    return check_answer(request.body);
  }
  const auto change = parse_change(request.path);
  return change ? std::optional<HttpOutcome>(change_study(service_, change->first, change->second))
                : std::nullopt;
}

// ---- Events ----------------------------------------------------------------------------------

HttpStream EventFeed::subscribe(const std::string& last_event_id) {
  using Clock = std::chrono::steady_clock;
  return [this, sent_id = last_event_id,
          sent_at = Clock::now()]() mutable -> std::optional<std::string> {
    refresh();
    const auto now = Clock::now();
    if (sent_id != id_ && !id_.empty()) {
      sent_id = id_;
      sent_at = now;
      return fmt::format("id: {}\nevent: overview\ndata: {}\n\n", id_, overview_);
    }
    if (now - sent_at >= kKeepAlive) {
      sent_at = now;
      return ": keep-alive\n\n";
    }
    return "";
  };
}

void EventFeed::refresh() {
  const auto latest = snapshots_.latest();
  if (latest == seen_) {
    return;
  }
  seen_ = latest;
  std::string overview = overview_json(*latest);
  if (overview != overview_) {
    overview_ = std::move(overview);
    // the clock keeps running while a server restarts, so no ID is repeated
    id_ = std::to_string(latest->made_ms);
  }
}

}  // namespace oblique::server
