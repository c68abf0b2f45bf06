#include "server/web/answers/study_answers.h"

#include <optional>
#include <stdexcept>
#include <utility>

#include "server/web/http/http_message.h"

namespace oblique::server {
namespace {

using protocol::ClientReply;
using protocol::ClientRequest;

constexpr unsigned kNotFound = 404;

class Flow {
 public:
  Flow(ServiceClient& service, std::uint64_t study, std::unique_ptr<StudyAnswer> answer,
       FlowClock::time_point deadline)
      : service_(service), answer_(std::move(answer)), deadline_(deadline) {
    exchange_.emplace(service_);
    study_.id = study;
    ClientRequest request;
    request.mutable_status()->set_study_id(study);
    exchange_->send(request);
  }

  std::optional<HttpAnswer> poll() {
    while (const auto reply = exchange_->reply()) {
      if (auto answer = reply->has_error() ? on_error(reply->error()) : on_reply(*reply)) {
        return answer;
      }
    }
    if (FlowClock::now() >= deadline_) {
      return error_answer(503, "that takes too long: ask for less, as by a condition");
    }
    return std::nullopt;
  }

 private:
  std::optional<HttpAnswer> on_reply(const ClientReply& reply) {
    if (reply.has_status()) {
      return on_status(reply.status());
    }
    if (reply.has_describe()) {
      study_.table = std::make_unique<const protocol::PointTable>(reply.describe().recipe());
      return go_on();
    }
    if (error_) {  // the condition alone is not wrong
      return error_;
    }
    if (!protocol::is_sound(reply.query())) {
      throw std::runtime_error("a reader process of the server sent no valid answer");
    }
    for (protocol::ChunkRows rows(reply.query()); rows.next();) {
      answer_->take_row(rows);
    }
    if (reply.query().ends()) {
      return go_on();
    }
    ClientRequest more;
    more.mutable_more_rows()->set_request_id(exchange_->number());
    more.mutable_more_rows()->set_taken(++chunks_);
    exchange_->send(more);
    return std::nullopt;
  }

  std::optional<HttpAnswer> on_status(const protocol::StatusReply& status) {
    if (status.studies_size() != 1) {
      return no_such_study();
    }
    const protocol::StudyStatus& found = status.studies(0);
    study_.name = found.name();
    study_.state = found.state();
    ClientRequest request;
    request.mutable_describe()->set_study(found.name());
    exchange_->send(request);
    return std::nullopt;
  }

  std::optional<HttpAnswer> on_error(const protocol::ErrorReply& error) {
    HttpAnswer answer = failure(error);
    if (answer.status == kNotFound) {
      return no_such_study();
    }
    if (error_ || answer_->condition().empty() || !error.wrong_request() || !study_.table) {
      return answer;
    }
    error_ = std::move(answer);
    protocol::StudyQuery as_written;
    as_written.add_select("point");
    as_written.set_where(answer_->condition());
    as_written.set_limit(1);
    send(std::move(as_written));
    return std::nullopt;
  }

  static HttpAnswer no_such_study() { return error_answer(kNotFound, "there is no such study"); }

  std::optional<HttpAnswer> go_on() {
    auto next = answer_->next(study_);
    if (auto* const answer = std::get_if<HttpAnswer>(&next)) {
      return std::move(*answer);
    }
    send(std::get<protocol::StudyQuery>(std::move(next)));
    return std::nullopt;
  }

  /// Each query has a number of its own, because a late error about the last one may follow.
  void send(protocol::StudyQuery query) {
    exchange_.emplace(service_);
    query.set_study(study_.name);
    chunks_ = 0;
    ClientRequest request;
    *request.mutable_query()->mutable_question() = std::move(query);
    exchange_->send(request);
  }

  ServiceClient& service_;
  std::optional<ServiceExchange> exchange_;
  ServedStudy study_;
  std::unique_ptr<StudyAnswer> answer_;
  const FlowClock::time_point deadline_;
  std::uint64_t chunks_ = 0;         // of the query that runs
  std::optional<HttpAnswer> error_;  // set while the condition runs as it was written
};

}  // namespace

PendingAnswer study_flow(ServiceClient& service, std::uint64_t study,
                         std::unique_ptr<StudyAnswer> answer, FlowClock::time_point deadline) {
  return [flow = std::make_shared<Flow>(service, study, std::move(answer), deadline)] {
    return flow->poll();
  };
}

}  // namespace oblique::server
