#include "server/web/page/talks.h"

#include <algorithm>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "server/web/answers/fields.h"
#include "server/web/answers/study_answers.h"
#include "server/web/http/json_answer.h"
#include "server/web/page/status_json.h"

namespace oblique::server {
namespace {

using protocol::ClientReply;
using protocol::ClientRequest;

constexpr unsigned kNotFound = 404;
constexpr unsigned kUnavailable = 503;

constexpr std::uint64_t kMostLines = 1000;

std::uint32_t lines_of(const FieldReader& fields) {
  return static_cast<std::uint32_t>(
      std::clamp<std::uint64_t>(fields.whole("limit").value_or(kMostLines), 1, kMostLines));
}

}  // namespace

ClientRequest status_of_number(std::uint64_t study) {
  ClientRequest request;
  request.mutable_status()->set_study_id(study);
  return request;
}

HttpAnswer no_such_study() {
  return error_answer(kNotFound, "there is no such study");
}

HttpAnswer too_slow() {
  return error_answer(kUnavailable, "the server takes too long: ask again later");
}

Talk talk_by_name(std::uint64_t study, std::function<ClientRequest(const std::string&)> ask,
                  std::function<Talk::Next(const ClientReply&)> go_on, HttpAnswer meanwhile) {
  return {status_of_number(study),
          [ask = std::move(ask), go_on = std::move(go_on)](const ClientReply& reply) -> Talk::Next {
            if (!reply.has_status()) {
              return go_on(reply);
            }
            return reply.status().studies_size() == 1
                       ? Talk::Next(ask(reply.status().studies(0).name()))
                       : Talk::Next(no_such_study());
          },
          std::move(meanwhile)};
}

Talk studies_talk(const HttpQuestion& question) {
  ClientRequest request;
  request.mutable_status()->set_after_study_id(
      FieldReader(question.fields).whole("after").value_or(0));
  request.mutable_status()->set_limit(lines_of(FieldReader(question.fields)));
  return {request,
          [](const ClientReply& reply) -> Talk::Next {
            nlohmann::ordered_json studies = nlohmann::ordered_json::array();
            for (const auto& study : reply.status().studies()) {
              studies.push_back(study_json(study));
            }
            return json_answer({{"studies", studies}, {"next_after", reply.status().next_after()}});
          },
          too_slow()};
}

Talk workers_talk(const HttpQuestion& question) {
  ClientRequest request;
  request.mutable_workers()->set_after_worker_id(
      FieldReader(question.fields).whole("after").value_or(0));
  request.mutable_workers()->set_limit(lines_of(FieldReader(question.fields)));
  return {
      request,
      [](const ClientReply& reply) -> Talk::Next {
        nlohmann::ordered_json workers = nlohmann::ordered_json::array();
        for (const auto& worker : reply.workers().workers()) {
          workers.push_back(worker_json(worker));
        }
        return json_answer({{"workers", workers}, {"next_after", reply.workers().next_after()}});
      },
      too_slow()};
}

std::optional<Talk> change_talk(std::uint64_t study, const std::string& change) {
  static const std::map<std::string, protocol::StudyChange> kChanges{
      {"pause", protocol::STUDY_CHANGE_PAUSE},
      {"resume", protocol::STUDY_CHANGE_RESUME},
      {"cancel", protocol::STUDY_CHANGE_CANCEL},
      {"retry", protocol::STUDY_CHANGE_RETRY}};
  const auto found = kChanges.find(change);
  if (found == kChanges.end()) {
    return std::nullopt;
  }
  return talk_by_name(
      study,
      [what = found->second](const std::string& name) {
        ClientRequest request;
        request.mutable_change()->set_study(name);
        request.mutable_change()->set_change(what);
        return request;
      },
      [](const ClientReply& reply) -> Talk::Next {
        return json_answer(
            {{"study", study_json(reply.change().study())}, {"retried", reply.change().retried()}});
      },
      too_slow());
}

Talk submit_talk(const HttpQuestion& question) {
  ClientRequest request;
  *request.mutable_submit() = study_of_body(question.body);
  return {request,
          [](const ClientReply& reply) -> Talk::Next {
            const protocol::SubmitReply& said = reply.submit();
            return json_answer({{"id", said.study_id()},
                                {"points", said.points()},
                                {"settled", said.settled()},
                                {"created", said.created()},
                                {"appended", said.appended()},
                                {"taken", said.taken().points()}});
          },
          error_answer(kUnavailable,
                       "its points take long to judge; it begins by itself when that is done: look "
                       "for it among the studies")};
}

}  // namespace oblique::server
