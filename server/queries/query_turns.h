#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "proto/oblique.pb.h"

namespace oblique::server {

/// A query of a client, on its way to a reader.
struct QueryJob {
  std::uint64_t ticket;
  std::string client;  ///< identity of its connection
  protocol::QueryRequest request;
};

/// Who may run and wait, and how long a query counts as quick.
struct TurnSettings {
  std::size_t readers = 4;                      ///< queries that run side by side; two or more
  std::size_t most_running_each = 2;            ///< of one client
  std::size_t most_waiting = 64;                ///< of all clients
  std::size_t most_waiting_each = 16;           ///< of one client
  std::size_t most_waiting_bytes = 16U << 20U;  ///< of all statements that wait
  std::int64_t quick_ms = 500;                  ///< a query that ran longer is slow
  std::size_t most_parked = 256;                ///< of all clients
};

/// Decides which query runs when. Clients take turns, each with its own queries in order. Slow
/// queries never hold all readers while another waits that is not known to be slow: the one begun
/// last is put back, to begin anew when a slow one has ended, for reading twice harms nothing. So a
/// quick query waits for quick ones only, whatever the others ask.
///
/// A query whose answer is given in parts may be bound to its reader from the first part on: it
/// cannot begin anew, and is not put back. Of those there is always one less than readers. One that
/// can go on from what it gave is never bound, and may be parked while its client wants nothing.
/// No thread, no clock.
class QueryTurns {
 public:
  explicit QueryTurns(TurnSettings settings) : settings_(settings) {}

  /// False when too many wait already; the job is dropped then.
  bool add(QueryJob job);
  /// The next job that may run, which counts as running from now on.
  std::optional<QueryJob> begin(std::int64_t now_ms);
  /// Ticket of a running job that must end for others, and waits again.
  std::optional<std::uint64_t> put_back(std::int64_t now_ms);
  /// When `put_back` may have something to say, unless anything else changes; nothing: never.
  std::optional<std::int64_t> next_change_ms(std::int64_t now_ms) const;
  /// From here on the running job cannot begin anew. False when as many as may be are bound
  /// already.
  bool bind(std::uint64_t ticket);
  /// The running job has given so much, from which it will go on when it begins again.
  void note_given(std::uint64_t ticket, const protocol::GivenRows& given);
  /// Whether somebody waits who could run if that running job did not.
  bool is_in_the_way(std::uint64_t ticket) const;
  /// The running job leaves its reader and neither runs nor waits until `unpark`. False when too
  /// many are parked; it runs on then.
  bool park(std::uint64_t ticket);
  /// A parked job waits for a reader again, before others of its client. Nothing for any other.
  void unpark(std::uint64_t ticket);
  /// A running job ended, or any job is no longer wanted.
  void remove(std::uint64_t ticket);

  std::size_t running() const { return running_.size(); }
  std::size_t waiting() const { return waiting_; }
  std::size_t parked() const { return parked_; }

 private:
  struct Client {
    std::deque<QueryJob> fresh;                  // not known to be slow
    std::deque<QueryJob> slow;                   // put back once
    std::map<std::uint64_t, QueryJob> parked{};  // by ticket
    std::size_t running = 0;
    std::uint64_t turn = 0;  // the lowest is next
  };
  struct Running {
    QueryJob job;
    std::int64_t begun_ms;
    std::uint64_t turn;  // the highest began last
    bool was_put_back;
    bool is_bound = false;
  };
  using Lane = std::deque<QueryJob> Client::*;

  bool is_slow(const Running& running, std::int64_t now_ms) const;
  std::size_t slow_running(std::int64_t now_ms) const;
  /// The client whose turn it is among those that may run one of `lane`; null: none.
  Client* next_client(Lane lane);
  QueryJob take(Client& client, Lane lane, std::int64_t now_ms);
  void forget_if_idle(const std::string& client);

  TurnSettings settings_;
  std::map<std::string, Client> clients_;     // that have a query here
  std::map<std::uint64_t, Running> running_;  // by ticket
  std::size_t waiting_ = 0;
  std::size_t waiting_bytes_ = 0;
  std::size_t parked_ = 0;
  std::uint64_t last_turn_ = 0;
};

}  // namespace oblique::server
