#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/web/http/http_message.h"

namespace oblique::server {

/// A text that changes, told to all tabs as server-sent events: it is looked for while a tab is
/// there, and written once for all of them. A tab that is slow gets the latest text next. Of one
/// thread.
class LiveText {
 public:
  /// Gives the text when it is another one than at the last look.
  using Look = std::function<std::optional<std::string>()>;

  /// `begun` tells this server from the one before it in the numbers of events.
  LiveText(Look look, std::int64_t begun);

  /// Events called `overview`, the present one first unless it is the one that was `seen` (a
  /// Last-Event-ID), and a comment every 15 s while there is none.
  std::shared_ptr<HttpStream> open(const std::string& seen);

 private:
  class Tab;
  using Clock = std::chrono::steady_clock;
  void look();

  Look look_;
  std::int64_t begun_;
  Clock::time_point looked_{};
  std::uint64_t number_ = 0;  // of the text; 0: there was none yet
  std::string event_;
};

}  // namespace oblique::server
