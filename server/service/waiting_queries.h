#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "proto/oblique.pb.h"
#include "server/query/query_pool.h"
#include "server/service/outbox/outbox.h"

namespace oblique::server {

/// Number of no request: a reply with it is passed over by clients that do not know its kind.
inline constexpr std::uint64_t kNobodysRequest = UINT64_MAX;

struct QueryCounts {
  std::uint64_t waiting = 0;
  std::uint64_t running = 0;
};

/// The queries of clients that have no answer yet. Who waits hears of it now and then, by which the
/// server also finds out that a client is gone; its query is cancelled then. Not thread-safe.
class WaitingQueries {
 public:
  /// A client is to hear of its query after each `word_every_ms`.
  WaitingQueries(ToClients& clients, ToReaders& readers, std::int64_t word_every_ms)
      : clients_(clients), readers_(readers), word_every_ms_(word_every_ms) {}

  /// Under the number of a query that waits or runs already, it is that query.
  void ask(const Client& client, const protocol::QueryRequest& request, Instant now);
  /// The client has taken so many chunks of an answer. It is told when there is no such answer.
  void more(const Client& client, const protocol::MoreRows& wish);
  /// The client wants nothing more of that answer.
  void end(std::string_view identity, std::uint64_t request_id);
  /// The pool tells how it is with a query.
  void report(QueryReport report);
  /// To be called several times a second.
  void tick(Instant now);
  /// The client has gone: nobody waits for its queries.
  void client_left(std::string_view identity);
  /// The server stops: whoever waits or asks is told.
  void stop();

  QueryCounts counts() const;

 private:
  struct Query {
    Client client;
    std::int64_t next_word_ms;  // when the client is to hear of it again
    bool runs = false;
    std::uint64_t given = 0;  // chunks
    std::uint64_t taken = 0;

    /// Whether it is the client who is waited for.
    bool waits_for_client() const { return given == taken + kChunksAhead; }
  };
  using Queries = std::map<std::uint64_t, Query>;

  bool tell(Query& query, Instant now);
  Queries::iterator find(std::string_view identity, std::uint64_t request_id);
  void cancel(Queries::iterator query);

  ToClients& clients_;
  ToReaders& readers_;
  std::int64_t word_every_ms_;
  Queries queries_;  // by ticket
  std::uint64_t last_ticket_ = 0;
  bool stopping_ = false;
};

}  // namespace oblique::server
