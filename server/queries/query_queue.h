#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <list>
#include <optional>
#include <set>
#include <string>

#include "proto/oblique.pb.h"

namespace oblique::server {

/// A query of a client.
struct QueryJob {
  std::uint64_t ticket;  ///< unique
  std::string client;    ///< who shares a place in the round: a key, or a connection
  protocol::QueryRequest request;
};

struct QueueSettings {
  std::size_t readers = 4;                      ///< queries that run at the same time
  std::size_t most_running_each = 2;            ///< of one client
  std::size_t most_waiting = 64;                ///< of all clients
  std::size_t most_waiting_each = 16;           ///< of one client
  std::size_t most_waiting_bytes = 16U << 20U;  ///< of all statements that wait
};

/// Decides which query runs next: round-robin over clients, first come first served within one.
/// Has no thread and no clock.
class QueryQueue {
 public:
  explicit QueryQueue(QueueSettings settings) : settings_(settings) {}

  /// False when too many queries wait; the job is dropped then.
  bool add(QueryJob job);
  /// Starts the next query that may run; it counts as running until `remove`.
  std::optional<QueryJob> start_next();
  /// Forgets a query, whether it waits or runs. Unknown tickets are ignored.
  void remove(std::uint64_t ticket);

 private:
  struct Client {
    std::string name;
    std::deque<QueryJob> waiting{};
    std::set<std::uint64_t> running{};  // tickets
  };

  QueueSettings settings_;
  std::list<Client> clients_;  // those with queries; the front is next
};

}  // namespace oblique::server
