#include "server/web/page/event_feed.h"

#include <chrono>
#include <optional>

#include <spdlog/fmt/fmt.h>

#include "server/web/status/status_json.h"

namespace oblique::server {
namespace {

constexpr std::chrono::seconds kKeepAlive{15};

}  // namespace

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
    id_ = std::to_string(latest->made_ms);  // unique: a restarted server goes on with the clock
  }
}

}  // namespace oblique::server
