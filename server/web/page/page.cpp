#include "server/web/page/page.h"

#include <charconv>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "server/web/answers/fields.h"
#include "server/web/answers/study_answers.h"
#include "server/web/http/json_answer.h"
#include "server/web/page/page_files.h"

namespace oblique::server {
namespace {

constexpr unsigned kSeeOther = 303;
constexpr unsigned kWrongQuestion = 400;
constexpr unsigned kUnauthorized = 401;
constexpr unsigned kForbidden = 403;
constexpr unsigned kNothingThere = 404;

constexpr std::string_view kApi = "/api/";
constexpr std::string_view kStudies = "/api/studies";
constexpr std::string_view kCheck = "/api/check";

/// Browsers wait so long for one answer; what takes longer is asked for again.
constexpr std::chrono::milliseconds kPatience{8000};

constexpr const char* kHowToEnter =
    "this server shows its page to who has its token: open the address that it printed when it "
    "started, or that `oblique view` prints";

HttpAnswer nothing_there() {
  return error_answer(kNothingThere, "there is nothing here");
}

/// Takes a number from the front; nothing: there is none.
std::optional<std::uint64_t> take_number(std::string_view& text) {
  std::uint64_t number = 0;
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc()) {
    return std::nullopt;
  }
  text.remove_prefix(static_cast<std::size_t>(rest - text.data()));
  return number;
}

}  // namespace

Page::Page(const PageSettings& settings, const Neighbours& neighbours)
    : shows_without_token_(settings.shows_without_token),
      file_(settings.is_of_file ? settings.database : ""),
      version_(settings.version),
      key_(settings.token.empty() ? PageKey() : PageKey(settings.token)),
      at_(neighbours) {}

bool Page::has(const std::string& path) {
  return path.starts_with(kApi) || is_page_file(path);
}

bool Page::takes_changes(const std::string& path) {
  if (path == kStudies || path == kCheck) {
    return true;
  }
  const auto place = place_of(path);
  return place && !place->point && change_talk(place->study, place->part).has_value();
}

std::optional<Page::Place> Page::place_of(const std::string& path) {
  std::string_view rest = path;
  if (!rest.starts_with(kStudies) || rest.size() <= kStudies.size() ||
      rest.at(kStudies.size()) != '/') {
    return std::nullopt;
  }
  rest.remove_prefix(kStudies.size() + 1);
  Place place;
  const auto study = take_number(rest);
  if (!study || *study == 0 || (!rest.empty() && rest.front() != '/')) {
    return std::nullopt;
  }
  place.study = *study;
  rest.remove_prefix(rest.empty() ? 0 : 1);
  constexpr std::string_view kPoints = "points/";
  if (rest.starts_with(kPoints)) {
    rest.remove_prefix(kPoints.size());
    place.point = take_number(rest);
    if (!place.point) {
      return std::nullopt;
    }
  }
  place.part = rest;
  return place;
}

bool Page::is_trusted(const HttpQuestion& question) const {
  return key_.is_in(question.cookies, question.host);
}

std::optional<HttpAnswer> Page::objection_to_change(const HttpQuestion& question) const {
  return is_trusted(question) ? std::nullopt
                              : std::optional(error_answer(kUnauthorized, kHowToEnter));
}

/// A token becomes a cookie, and goes from the browser's address and history.
std::optional<HttpAnswer> Page::enter(const HttpQuestion& question) const {
  const auto token = question.fields.find("token");
  if (question.path != "/" || token == question.fields.end()) {
    return std::nullopt;
  }
  if (!key_.is_token(token->second)) {
    return HttpAnswer{kForbidden, "text/plain; charset=utf-8",
                      "that is not the token of this server, which draws another one each time it "
                      "starts\n"};
  }
  return HttpAnswer{kSeeOther,
                    "text/plain; charset=utf-8",
                    "",
                    {{"Location", "/"}, {"Set-Cookie", key_.cookie_for(question.host)}}};
}

HttpAnswer Page::session(const HttpQuestion& question) const {
  const bool trusted = is_trusted(question);
  return json_answer({{"version", version_},
                      {"may_look", trusted || shows_without_token_},
                      {"may_change", trusted},
                      {"file", trusted ? file_ : ""},
                      {"how_to_enter", trusted ? "" : kHowToEnter}});
}

std::optional<HttpAnswer> Page::answer(const HttpQuestion& question) {
  const auto known = under_way_.find(question.number);
  if (known == under_way_.end()) {
    try {
      return begin(question);
    } catch (const std::invalid_argument& error) {
      return error_answer(kWrongQuestion, error.what());
    }
  }
  auto answer = go_on(question, known->second);
  if (!answer && question.waited > kPatience) {
    const auto* const talk = std::get_if<Talk>(&known->second);
    answer = talk != nullptr ? talk->meanwhile : too_slow();
    at_.service.leave(question.number);
  }
  if (answer) {
    under_way_.erase(question.number);
  }
  return answer;
}

void Page::gone(std::uint64_t number) {
  under_way_.erase(number);
  at_.service.forget(number);
}

std::optional<HttpAnswer> Page::begin(const HttpQuestion& question) {
  if (auto entered = enter(question)) {
    return entered;
  }
  const std::string& path = question.path;
  if (!path.starts_with(kApi)) {
    return file_answer(question);
  }
  if (path == "/api/session") {
    return session(question);
  }
  if (!shows_without_token_ && !is_trusted(question)) {
    return error_answer(kUnauthorized, kHowToEnter);
  }
  if (!is_text(question.fields)) {
    return error_answer(kWrongQuestion, "fields of a request are UTF-8");
  }
  if (question.method == "POST") {
    return begin_change(question);
  }
  if (path == "/api/events") {
    return HttpAnswer{200, "text/event-stream", {}, {}, at_.overview.open(question.seen_event)};
  }
  if (path == kStudies) {
    return begin(question, studies_talk(question));
  }
  if (path == "/api/workers") {
    return begin(question, workers_talk(question));
  }
  const auto place = place_of(path);
  return place ? begin_study(question, *place) : nothing_there();
}

std::optional<HttpAnswer> Page::begin_study(const HttpQuestion& question, const Place& place) {
  if (place.point && place.part == "/trace") {
    return begin(question, trace_talk(place.study, *place.point, question));
  }
  if (!place.point && place.part == "rows") {
    return begin(question, rows_talk(place.study, question));
  }
  if (place.point && place.part.empty()) {
    return begin(question, point_answer(at_.service, place.study, *place.point));
  }
  if (!place.point && place.part.empty()) {
    return begin(question, study_answer(at_.service, place.study));
  }
  if (!place.point && place.part == "slice") {
    return begin(question, slice_answer(at_.service, place.study, question.fields));
  }
  if (!place.point && place.part == "bins") {
    return begin(question, bins_answer(at_.service, place.study, question.fields));
  }
  return nothing_there();
}

std::optional<HttpAnswer> Page::begin_change(const HttpQuestion& question) {
  if (question.path == kStudies) {
    return begin(question, submit_talk(question));
  }
  if (question.path == kCheck) {
    return check_answer(question.body);
  }
  const auto place = place_of(question.path);
  auto talk = place ? change_talk(place->study, place->part) : std::nullopt;
  return talk ? begin(question, std::move(*talk)) : nothing_there();
}

std::optional<HttpAnswer> Page::begin(const HttpQuestion& question, Talk talk) {
  at_.service.ask(question.number, talk.first);
  under_way_.emplace(question.number, std::move(talk));
  return std::nullopt;
}

std::optional<HttpAnswer> Page::begin(const HttpQuestion& question, PendingAnswer pending) {
  under_way_.emplace(question.number, std::move(pending));
  return std::nullopt;
}

std::optional<HttpAnswer> Page::go_on(const HttpQuestion& question, const UnderWay& under_way) {
  const auto* const pending = std::get_if<PendingAnswer>(&under_way);
  return pending != nullptr ? (*pending)() : hear(question.number, std::get<Talk>(under_way));
}

/// The answer at the end of a talk; nothing while a reply is awaited.
std::optional<HttpAnswer> Page::hear(std::uint64_t number, const Talk& talk) {
  while (const auto reply = at_.service.reply(number)) {
    Talk::Next next = reply->has_error() ? failure(reply->error()) : talk.go_on(*reply);
    auto* const request = std::get_if<protocol::ClientRequest>(&next);
    if (request == nullptr) {
      at_.service.forget(number);
      return std::get<HttpAnswer>(std::move(next));
    }
    at_.service.ask(number, std::move(*request));
  }
  return std::nullopt;
}

}  // namespace oblique::server
