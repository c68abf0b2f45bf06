#include "server/service/ports/ports.h"

#include <bit>
#include <ctime>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"

namespace oblique::server {

std::string iso_8601(Instant now) {
  const std::time_t seconds = static_cast<std::time_t>(now.utc_ms / 1000);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:03}Z", parts.tm_year + 1900,
                     parts.tm_mon + 1, parts.tm_mday, parts.tm_hour, parts.tm_min, parts.tm_sec,
                     now.utc_ms % 1000);
}

Delivery Ports::send(const std::string& worker, const protocol::ServerToWorker& message) {
  return to_worker(worker, protocol::encode(message));
}

bool Ports::reply(const Client& client, protocol::ClientReply reply) {
  reply.set_request_id(client.request_id);
  return to_client(client.identity, protocol::encode(reply));
}

bool Ports::reply_error(const Client& client, const std::string& message) {
  protocol::ClientReply error;
  error.mutable_error()->set_message(message);
  return reply(client, std::move(error));
}

bool Ports::reply_still_working(const Client& client, bool runs) {
  // No request has this number: clients that do not know the message ignore it.
  constexpr std::uint64_t kNoRequest = UINT64_MAX;
  protocol::ClientReply message;
  message.mutable_still_working()->set_request_id(client.request_id);
  message.mutable_still_working()->set_runs(runs);
  return reply({client.identity, kNoRequest}, std::move(message));
}

void BadFrames::count(std::string_view sender) {
  ++count_;
  if (std::has_single_bit(count_)) {
    ports_.log(
        Severity::kWarning,
        fmt::format("{} sent a frame that is no message ({} of them so far)", sender, count_));
  }
}

}  // namespace oblique::server
