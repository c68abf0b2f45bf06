#pragma once

#include <functional>
#include <optional>
#include <string>
#include <variant>

#include "proto/oblique.pb.h"
#include "server/web/answers/service_client.h"
#include "server/web/http/http_message.h"

namespace oblique::server {

/// What the page and the service say to each other for one request of a browser.
struct Talk {
  using Next = std::variant<HttpAnswer, protocol::ClientRequest>;
  protocol::ClientRequest first;
  /// What follows from a reply that is no error: the answer or the next request.
  std::function<Next(const protocol::ClientReply&)> go_on;
  /// The answer while the service takes longer than a browser should wait.
  HttpAnswer meanwhile;
};

/// That it takes too long.
HttpAnswer too_slow();

/// Asks for the study of that number.
protocol::ClientRequest status_of_number(std::uint64_t study);
/// That there is none.
HttpAnswer no_such_study();

/// A talk about a study of that number. Most requests want its name: `ask` makes one with it, and
/// `go_on` hears the replies to that.
Talk talk_by_name(std::uint64_t study,
                  std::function<protocol::ClientRequest(const std::string&)> ask,
                  std::function<Talk::Next(const protocol::ClientReply&)> go_on,
                  HttpAnswer meanwhile);

/// A page of studies: of `after` and `limit`.
Talk studies_talk(const HttpQuestion& question);
/// A page of workers: of `after` and `limit`.
Talk workers_talk(const HttpQuestion& question);
/// Rows of a study, as `where`, `select`, `group`, `order`, `limit` and `format` (json or csv) say.
Talk rows_talk(std::uint64_t study, const HttpQuestion& question);
/// The time histories of a point; `shape=1`: with the positions of the nodes.
Talk trace_talk(std::uint64_t study, std::uint64_t point, const HttpQuestion& question);
/// `change`: pause, resume, cancel or retry; nothing: there is no such change.
std::optional<Talk> change_talk(std::uint64_t study, const std::string& change);
/// A study, as the body says. Throws std::runtime_error for a body that is none.
Talk submit_talk(const HttpQuestion& question);

}  // namespace oblique::server
