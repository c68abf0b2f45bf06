#include "server/service/ports.h"

#include <ctime>
#include <utility>

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

bool Ports::reply(const Client& client, protocol::ClientReply reply) {
  reply.set_request_id(client.request_id);
  return to_client(client.identity, protocol::encode(reply));
}

bool Ports::reply_error(const Client& client, const std::string& message,
                        protocol::ErrorCode code) {
  return reply(client, error_reply(message, code));
}

bool Ports::reply_still_working(const Client& client, bool runs) {
  protocol::ClientReply message;
  message.mutable_still_working()->set_runs(runs);
  return reply(client, std::move(message));
}

protocol::ClientReply error_reply(const std::string& message, protocol::ErrorCode code) {
  protocol::ClientReply reply;
  reply.mutable_error()->set_code(code);
  reply.mutable_error()->set_message(message);
  return reply;
}

void PeerLog::write(Severity severity, const std::string& text) {
  if (++lines_ <= kMaxLines) {
    ports_.log(severity, text);
  }
}

void PeerLog::write_of_stranger(const std::string& text) {
  if (++stranger_lines_ <= kMaxLines) {
    ports_.log(Severity::kWarning, text);
  }
}

void PeerLog::bad_frame(std::string_view sender) {
  ++bad_frames_;
  write_of_stranger(fmt::format("{} sent an invalid frame ({} so far)", sender, bad_frames_));
}

void PeerLog::tick(std::int64_t now_ms) {
  constexpr std::int64_t kSpan_ms = 10'000;
  if (now_ms - span_began_ms_ < kSpan_ms) {
    return;
  }
  for (std::uint64_t* lines : {&lines_, &stranger_lines_}) {
    if (*lines > kMaxLines) {
      ports_.log(Severity::kInfo, fmt::format("and {} more lines about peers", *lines - kMaxLines));
    }
    *lines = 0;
  }
  span_began_ms_ = now_ms;
}

}  // namespace oblique::server
