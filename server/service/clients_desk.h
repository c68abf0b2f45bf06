#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "proto/oblique.pb.h"
#include "server/service/outbox/log_limits.h"
#include "server/service/outbox/outbox.h"
#include "server/service/outbox/request_reader.h"
#include "server/service/study_changes.h"
#include "server/service/traces/trace_handler.h"
#include "server/service/views.h"
#include "server/service/waiting_queries.h"
#include "server/service/workers_desk.h"

namespace oblique::server {

struct ClientsDeskSettings {
  /// How often a client hears that its query or long request waits or runs, by which the server
  /// also finds out that the client is gone.
  std::int64_t still_working_every_ms = 1000;
  std::string access = "loopback";  ///< as StatusReply.access
  std::string version{};            ///< as StatusReply.version
};

/// Speaks with clients: takes their requests, shows them how things stand, in pages where that is
/// long, and passes on what is to be changed, queried or read elsewhere. Every frame is taken for
/// hostile until it is parsed. Not thread-safe.
class ClientsDesk {
 public:
  /// All of these must outlive the desk.
  struct Neighbours {
    ToClients& clients;
    ToReaders& readers;
    BadFrames& bad_frames;
    StudyChanges& changes;
    const WorkersDesk& workers;
    StudySources sources;
    const ToNetwork& network;
    const SettledRates& worker_rates;
    TraceHandler& traces;
  };

  ClientsDesk(const ClientsDeskSettings& settings, const Neighbours& neighbours);

  /// `holder`: of the client's key; null without keys.
  void take(const std::string& identity, std::string_view frame, Instant now,
            const std::shared_ptr<const KeyHolder>& holder);
  /// A long request was read.
  void request_read(const ReadReport& report, Instant now);
  void queried(QueryReport report) { queries_.report(std::move(report)); }
  /// The connection of that client is gone, and nothing of it waits to be taken.
  void client_left(std::string_view identity);
  /// To be called several times a second.
  void tick(Instant now);
  /// The server will stop: no study is taken any more.
  void drain() { draining_ = true; }
  /// The server stops: who waits here is told, and what is asked from now on is refused.
  void stop();

  QueryCounts query_counts() const { return queries_.counts(); }

 private:
  struct LongRequest {
    Client client;
    std::size_t bytes;
  };

  void read_elsewhere(const Client& client, std::string_view frame);
  bool may_ask(const Client& client, const protocol::ClientRequest& request);
  std::string objection_to(const ReadRequest& read);
  void answer(const Client& client, const ReadRequest& read, Instant now);
  void submit(const Client& client, const ReadRequest& read, Instant now);
  protocol::StudyStatus status_of(StudyId id, Instant now) const;
  void status(const Client& client, const protocol::StatusRequest& request, Instant now);
  void describe(const Client& client, const protocol::DescribeRequest& request);
  void workers(const Client& client, const protocol::WorkersRequest& request, Instant now);
  void add_keys(protocol::WorkersReply& reply) const;
  void trace(const Client& client, const protocol::TraceRequest& request, Instant now);

  ClientsDeskSettings settings_;
  Neighbours at_;
  WaitingQueries queries_;
  std::map<std::uint64_t, LongRequest> long_requests_;  // by ticket
  std::uint64_t last_ticket_ = 0;
  std::int64_t told_ms_ = 0;  // when those who wait for long requests last heard of them
  bool stopping_ = false;
  bool draining_ = false;
};

}  // namespace oblique::server
