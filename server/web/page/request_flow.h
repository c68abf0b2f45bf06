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
#include "server/web/answers/service_client.h"
#include "server/web/http/http_message.h"

// HTTP requests that the service answers. README.md has their fields. Functions throw
// std::invalid_argument for a wrong request.
namespace oblique::server {

/// What follows from a reply: the answer or the next request.
using NextStep = std::variant<HttpAnswer, protocol::ClientRequest>;
using OnReply = std::function<NextStep(const protocol::ClientReply&)>;

/// Sends requests one after the other until there is an answer. An error of the service is one.
PendingAnswer request_flow(std::shared_ptr<ServiceExchange> exchange,
                           const protocol::ClientRequest& first, OnReply on_reply);

/// The same for a study that HTTP identifies by its number and the service by its name: `request`
/// gets the name from `set_name` before it is sent.
PendingAnswer named_study_flow(
    std::shared_ptr<ServiceExchange> exchange, std::uint64_t study,
    std::function<protocol::ClientRequest(const std::string& name)> request, OnReply on_reply);

PendingAnswer list_studies(ServiceClient& service, const Fields& fields);
PendingAnswer list_workers(ServiceClient& service, const Fields& fields);
PendingAnswer query_rows(ServiceClient& service, std::uint64_t study, const Fields& fields);
PendingAnswer solve_trace(ServiceClient& service, std::uint64_t study, std::uint64_t point,
                          const Fields& fields);
PendingAnswer submit_study(ServiceClient& service, const std::string& body);
PendingAnswer change_study(ServiceClient& service, std::uint64_t study,
                           protocol::StudyChange change);
/// Parses pause, resume, cancel or retry.
std::optional<protocol::StudyChange> study_change(std::string_view name);

}  // namespace oblique::server
