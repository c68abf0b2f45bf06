#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "proto/oblique.pb.h"
#include "server/web/answers/fields.h"
#include "server/web/answers/service_line.h"
#include "server/web/http/http_message.h"

// HTTP requests that the service answers. README.md has their fields. Functions throw
// std::invalid_argument for a wrong request.
namespace oblique::server {

/// Requests to the service under one number. The destructor ends what the service still does.
class ServiceExchange {
 public:
  explicit ServiceExchange(ServiceLine& service)
      : service_(service), number_(service.new_number()) {}
  ~ServiceExchange() { service_.forget(number_); }
  ServiceExchange(const ServiceExchange&) = delete;
  ServiceExchange& operator=(const ServiceExchange&) = delete;

  std::uint64_t number() const { return number_; }
  void send(const protocol::ClientRequest& request) { service_.ask(number_, request); }
  /// The next reply, if it has come.
  std::optional<protocol::ClientReply> reply() { return service_.reply(number_); }

 private:
  ServiceLine& service_;
  const std::uint64_t number_;
};

/// What follows from a reply: the answer or the next request.
using NextStep = std::variant<HttpAnswer, protocol::ClientRequest>;
using OnReply = std::function<NextStep(const protocol::ClientReply&)>;

/// Sends requests one after the other until there is an answer. An error of the service is one.
PendingAnswer request_flow(std::shared_ptr<ServiceExchange> exchange,
                           const protocol::ClientRequest& first, OnReply on_reply);

/// The same for a study that HTTP identifies by its number and the service by its name: `request`
/// gets the name from `set_name` before it is sent.
PendingAnswer study_flow(std::shared_ptr<ServiceExchange> exchange, std::uint64_t study,
                         std::function<protocol::ClientRequest(const std::string& name)> request,
                         OnReply on_reply);

PendingAnswer list_studies(ServiceLine& service, const Fields& fields);
PendingAnswer list_workers(ServiceLine& service, const Fields& fields);
PendingAnswer query_rows(ServiceLine& service, std::uint64_t study, const Fields& fields);
PendingAnswer solve_trace(ServiceLine& service, std::uint64_t study, std::uint64_t point,
                          const Fields& fields);
PendingAnswer submit_study(ServiceLine& service, const std::string& body);
PendingAnswer change_study(ServiceLine& service, std::uint64_t study, protocol::StudyChange change);
/// Parses pause, resume, cancel or retry.
std::optional<protocol::StudyChange> study_change(std::string_view name);

}  // namespace oblique::server
