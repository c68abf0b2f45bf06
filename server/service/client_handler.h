#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "proto/oblique.pb.h"
#include "server/service/ports.h"
#include "server/service/status.h"
#include "server/service/study_changes.h"
#include "server/service/worker_sessions.h"

namespace oblique::server {

struct ClientHandlerSettings {
  /// Interval of StillWorking messages. A client to which none can be sent counts as gone.
  std::int64_t still_working_every_ms = 1000;
  std::string access = "loopback";  ///< value of StatusReply.access
  std::string version{};            ///< value of StatusReply.version
};

struct QueryCounts {
  std::uint64_t waiting = 0;
  std::uint64_t running = 0;
};

/// Handles requests of clients: answers requests for status, and passes on changes, queries and
/// traces. Frames may be malicious. Not thread-safe.
class ClientHandler {
 public:
  ClientHandler(ClientHandlerSettings settings, const Core& core, PeerLog& log,
                StudyChanges& changes)
      : settings_(std::move(settings)), core_(core), log_(log), changes_(changes) {}

  /// `holder` is the client's key; null without keys.
  void frame(const std::string& identity, std::string_view frame, Instant now,
             const std::shared_ptr<const KeyIdentity>& holder);
  void query_report(QueryReport report);
  void trace_received(WorkerId worker, protocol::Trace trace);
  /// Handles the end of a worker. WorkerSessions must already have removed it.
  void worker_left(WorkerId worker);
  /// Handles a client's disconnection, after all requests that it sent.
  void client_left(std::string_view identity);
  /// Must be called several times a second.
  void tick(Instant now);
  /// Refuses new studies from now on, because the server will stop.
  void drain() { draining_ = true; }
  /// Answers pending and later requests with an error, because the server stops.
  void stop();

  QueryCounts query_counts() const;

 private:
  /// A trace that a worker solves in addition to its batches.
  struct TraceJob {
    bool only_point;
    std::uint64_t point;
    std::int64_t deadline_ms;
    protocol::TraceOrder order{};
    protocol::TraceReply reply{};      ///< all fields except the trace
    bool is_ready = false;             ///< true if the inputs of the point are known
    std::optional<WorkerId> worker{};  ///< worker that solves the trace
    std::set<WorkerId> declined_by{};  ///< workers that declined the trace
    bool has_lost_worker = false;
  };
  /// A request that waits for the check thread, the query pool or a worker.
  struct Pending {
    Client client;
    std::int64_t next_sign_ms;                   ///< time at which the next StillWorking is due
    std::shared_ptr<const std::string> frame{};  ///< frame to check; null for a query or trace
    std::optional<TraceJob> trace{};
    bool runs = false;
    std::uint64_t sent = 0;      ///< number of chunks sent
    std::uint64_t received = 0;  ///< number of chunks that the client has received

    bool is_query() const { return frame == nullptr && !trace; }
  };
  using PendingRequests = std::map<std::uint64_t, Pending>;

  void check(const Client& client, std::string_view frame, Instant now);
  void checked(std::uint64_t ticket, ReadRequest&& read, Instant now);
  std::string request_error(const Client& client, const ReadRequest& read);
  /// Answers `read`, which was parsed from `frame`, or lets the check thread validate it first.
  void answer(const Client& client, ReadRequest&& read, std::string_view frame, Instant now);
  void query(const Client& client, protocol::QueryRequest request, Instant now);
  void more_rows(const Client& client, const protocol::MoreRows& request);
  void end_query(const Client& client, std::uint64_t request_id);
  void status(const Client& client, const protocol::StatusRequest& request, Instant now);
  void describe(const Client& client, const protocol::DescribeRequest& request);
  void workers(const Client& client, const protocol::WorkersRequest& request, Instant now);
  void trace(const Client& client, const protocol::TraceRequest& request, Instant now);
  protocol::StudyStatus status_of(StudyId id, Instant now) const;
  /// Returns the durable study with number `id` or, if `id` is 0, with that name. Sends the client
  /// an error if there is none.
  std::optional<StudyId> find_study(const Client& client, const std::string& name, StudyId id = 0);
  /// Returns the client's query or trace with that request number.
  PendingRequests::iterator find(std::string_view identity, std::uint64_t request_id);
  Pending& add(std::uint64_t ticket, const Client& client, Instant now);
  /// Remove a request and return the next request.
  PendingRequests::iterator cancel(PendingRequests::iterator request);
  PendingRequests::iterator refuse(PendingRequests::iterator request, const std::string& reason);
  static protocol::ClientReply find_point(const StudyTable& study, bool is_table_made,
                                          std::uint64_t point);
  void point_found(std::uint64_t ticket, protocol::ClientReply found);
  void inputs_found(PendingRequests::iterator request);
  void dispatch_traces();
  std::optional<WorkerId> free_worker(const TraceJob& job) const;
  protocol::ClientReply trace_reply(TraceJob& job, const WorkerRecord& worker,
                                    protocol::Trace trace) const;

  ClientHandlerSettings settings_;
  const Core& core_;
  PeerLog& log_;
  StudyChanges& changes_;
  PendingRequests pending_;  // by ticket
  std::uint64_t last_ticket_ = 0;
  std::size_t point_checks_ = 0;  // running checks of trace requests, also of absent clients
  // ticket of the trace order that a worker has not answered yet
  std::map<WorkerId, std::uint64_t> orders_;
  bool stopping_ = false;
  bool draining_ = false;
};

}  // namespace oblique::server
