#include "server/service/outbox/outbox.h"

#include <ctime>

#include <spdlog/fmt/fmt.h>

namespace oblique::server {

std::string iso_8601(Instant now) {
  const std::time_t seconds = static_cast<std::time_t>(now.utc_ms / 1000);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:03}Z", parts.tm_year + 1900,
                     parts.tm_mon + 1, parts.tm_mday, parts.tm_hour, parts.tm_min, parts.tm_sec,
                     now.utc_ms % 1000);
}

void ToClients::reply_error(const Client& client, const std::string& message) {
  protocol::ClientReply reply;
  reply.set_request_id(client.request_id);
  reply.mutable_error()->set_message(message);
  to_client(client.identity, reply);
}

}  // namespace oblique::server
