#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "server/web/http/http_message.h"
#include "server/web/status/snapshot.h"

namespace oblique::server {

/// Sends the overview to all tabs as server-sent events called `overview`. The text is made once
/// for all tabs, while there are any; a slow tab gets the latest one next. Used by the HTTP thread.
class EventFeed {
 public:
  explicit EventFeed(const SnapshotCache& snapshots) : snapshots_(snapshots) {}

  /// Begins with the current overview unless `last_event_id` is its ID; a comment every 15 s keeps
  /// the connection open.
  HttpStream subscribe(const std::string& last_event_id);

 private:
  void refresh();

  const SnapshotCache& snapshots_;
  std::shared_ptr<const Snapshot> seen_;
  std::string overview_;
  std::string id_;  ///< of the overview; empty: there is none yet
};

}  // namespace oblique::server
