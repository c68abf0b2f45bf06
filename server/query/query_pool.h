#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/system/wake_up.h"
#include "server/query/reader_process.h"
#include "server/study/limits.h"

namespace oblique::server {

/// A query of a client.
struct QueryJob {
  std::uint64_t ticket;  ///< unique
  std::string client;    ///< the key or connection; clients take turns
  protocol::QueryRequest request;
};

struct QueueSettings {
  std::size_t readers = limits::kRunningQueries;                    ///< that run at the same time
  std::size_t most_running_each = limits::kRunningQueriesOfClient;  ///< of one client
  std::size_t most_waiting = limits::kWaitingQueries;               ///< of all clients
  std::size_t most_waiting_each = limits::kWaitingQueriesOfClient;  ///< of one client
  std::size_t most_waiting_bytes = limits::kWaitingQueryBytes;      ///< of all statements that wait
};

/// Decides which query runs next: round-robin over clients, in order of arrival within one.
/// Has no thread and no clock.
class QueryQueue {
 public:
  explicit QueryQueue(QueueSettings settings) : settings_(settings) {}

  /// False when too many queries wait; the job is dropped then.
  bool add(QueryJob job);
  /// Starts the next query that may run; it counts as running until `remove`.
  std::optional<QueryJob> start_next();
  /// Removes a query that waits or runs. Unknown tickets are ignored.
  void remove(std::uint64_t ticket);

 private:
  struct Client {
    std::string name;
    std::deque<QueryJob> waiting{};
    std::set<std::uint64_t> running{};  // tickets
  };

  QueueSettings settings_;
  std::list<Client> clients_;  // clients that have queries; the front one is next
};

/// Progress of a query.
struct QueryReport {
  enum class Kind {
    kBegun,     ///< it has begun to run
    kRows,      ///< `reply` is a chunk of the answer, not the last
    kAnswered,  ///< `reply` is the last chunk, or an error
  };
  Kind kind;
  std::uint64_t ticket;
  std::string reply;  ///< an encoded ClientReply without request_id
};

struct QueryPoolSettings {
  /// Program of the reader processes (reader_program.h); the default is this program.
  std::string reader_program = "/proc/self/exe";
  QueueSettings queue;
  /// A client that takes none of kChunksAhead chunks for this time loses its answer.
  std::int64_t patience_ms = 10'000;
  /// Longest time of a whole answer, including the time in which it waits for its client.
  std::int64_t longest_answer_ms = 1'800'000;
  std::function<std::int64_t()> now_ms = [] {
    using std::chrono::steady_clock;
    return std::chrono::duration_cast<std::chrono::milliseconds>(
               steady_clock::now().time_since_epoch())
        .count();
  };
};

/// Most chunks that are sent to a client before it has taken the first of them.
inline constexpr std::uint64_t kChunksAhead = 4;

/// Runs queries in reader processes, which are started when needed and kept for later queries. A
/// process has a memory limit and can be stopped at any time, whatever its statement does. One
/// thread serves all processes.
class QueryPool {
 public:
  using Report = std::function<void(QueryReport)>;

  /// `report` is called on the pool's thread. No process is started before the first query.
  QueryPool(std::string database, QueryPoolSettings settings, Report report);
  /// Calls `stop`.
  ~QueryPool();
  QueryPool(const QueryPool&) = delete;
  QueryPool& operator=(const QueryPool&) = delete;

  /// False when too many queries wait (QueueSettings).
  bool submit(QueryJob job);
  /// The client has taken the first `taken` chunks of its answer.
  void more(std::uint64_t ticket, std::uint64_t taken);
  /// Ends a query, or removes it from the queue. Reports of it may still arrive.
  void cancel(std::uint64_t ticket);
  /// Kills all processes and ends the thread. Open queries get no answer.
  void stop();

 private:
  /// A process with the query that it runs.
  struct Slot {
    std::unique_ptr<ReaderProcess> process;
    std::uint64_t ticket = 0;  ///< 0: none
    std::int64_t time_limit_ms = 0;
    std::int64_t deadline_ms = 0;     ///< for the next chunk, or for the client to take one
    std::int64_t answer_ends_ms = 0;  ///< deadline of the whole answer
    std::uint64_t given = 0;          ///< chunks reported
    std::uint64_t taken = 0;          ///< chunks taken by the client

    bool waits_for_client() const { return ticket != 0 && given >= taken + kChunksAhead; }
  };

  void run();
  void turn();
  void wait();
  void take_requests();
  void start_queries();
  void start(const QueryJob& job);
  void read(Slot& slot);
  void check_deadline(Slot& slot);
  void finish(Slot& slot, std::string reply);
  void fail(Slot& slot, const std::string& message);
  Slot* slot_of(std::uint64_t ticket);
  Slot& idle_slot();
  void forget(std::uint64_t ticket);

  const std::string database_;
  const QueryPoolSettings settings_;
  const Report report_;
  const protocol::WakeUp woken_;
  std::mutex mutex_;
  QueryQueue queue_;                              // guarded by mutex_
  std::map<std::uint64_t, std::uint64_t> taken_;  // guarded by mutex_; chunks, by ticket
  bool stopping_ = false;                         // guarded by mutex_
  std::vector<Slot> slots_;                       // used by the thread only
  std::thread thread_;                            // last: it uses the other members
};

}  // namespace oblique::server
