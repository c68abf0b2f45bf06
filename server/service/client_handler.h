#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "proto/oblique.pb.h"
#include "server/service/ports/ports.h"
#include "server/service/status.h"
#include "server/service/study_changes.h"
#include "server/service/trace_handler.h"
#include "server/service/worker_sessions.h"

namespace oblique::server {

struct ClientHandlerSettings {
  /// Interval of the messages that a request waits or runs. A failure to send one shows that the
  /// client is gone.
  std::int64_t still_working_every_ms = 1000;
  std::string access = "loopback";  ///< as StatusReply.access
  std::string version{};            ///< as StatusReply.version
};

struct QueryCounts {
  std::uint64_t waiting = 0;
  std::uint64_t running = 0;
};

/// Handles the requests of clients: answers those about the status, and passes changes, queries and
/// traces on. Frames may be malicious. Not thread-safe.
class ClientHandler {
 public:
  ClientHandler(ClientHandlerSettings settings, const Core& core, BadFrames& bad_frames,
                StudyChanges& changes, TraceHandler& traces)
      : settings_(std::move(settings)),
        core_(core),
        bad_frames_(bad_frames),
        changes_(changes),
        traces_(traces) {}

  /// `holder`: of the client's key; null without keys.
  void frame(const std::string& identity, std::string_view frame, Instant now,
             const std::shared_ptr<const KeyIdentity>& holder);
  void query_report(QueryReport report);
  /// The connection of that client is gone, and all its requests were taken.
  void client_left(std::string_view identity);
  /// To be called several times a second.
  void tick(Instant now);
  /// The server will stop: no further study is accepted.
  void drain() { draining_ = true; }
  /// The server stops: pending and later requests get an error.
  void stop();

  QueryCounts query_counts() const;

 private:
  /// A request that waits for the check thread or the query pool.
  struct Pending {
    Client client;
    std::shared_ptr<const std::string> frame;  ///< of a long request; null: a query
    std::int64_t next_sign_ms;                 ///< when the client gets the next such message
    bool runs = false;
    std::uint64_t sent = 0;  ///< chunks of the answer
    std::uint64_t taken = 0;
  };
  using PendingRequests = std::map<std::uint64_t, Pending>;

  void check(const Client& client, std::string_view frame, Instant now);
  void checked(std::uint64_t ticket, const ReadRequest& read, Instant now);
  std::string objection_to(const Client& client, const ReadRequest& read);
  void answer(const Client& client, const ReadRequest& read, Instant now);
  void query(const Client& client, const protocol::QueryRequest& request, Instant now);
  void more_rows(const Client& client, const protocol::MoreRows& request);
  void end_query(const Client& client, std::uint64_t request_id);
  void status(const Client& client, const protocol::StatusRequest& request, Instant now);
  void describe(const Client& client, const protocol::DescribeRequest& request);
  void workers(const Client& client, const protocol::WorkersRequest& request, Instant now);
  void trace(const Client& client, const protocol::TraceRequest& request, Instant now);
  protocol::StudyStatus status_of(StudyId id, Instant now) const;
  PendingRequests::iterator find(std::string_view identity, std::uint64_t request_id);
  PendingRequests::iterator cancel(PendingRequests::iterator request);

  ClientHandlerSettings settings_;
  const Core& core_;
  BadFrames& bad_frames_;
  StudyChanges& changes_;
  TraceHandler& traces_;
  PendingRequests pending_;  // by ticket
  std::uint64_t last_ticket_ = 0;
  bool stopping_ = false;
  bool draining_ = false;
};

}  // namespace oblique::server
