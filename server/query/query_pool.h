#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include <sys/types.h>

#include "proto/oblique.pb.h"
#include "proto/system/descriptor.h"
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
  using Running = std::map<std::uint64_t, std::string>;

  QueueSettings settings_;
  std::deque<QueryJob> waiting_;  // the jobs of the next client come first
  Running running_;               // clients, by ticket
};

/// Progress of a query: it has begun to run, `reply` is a chunk of the answer, or `reply` is the
/// last chunk or an error.
struct QueryReport {
  enum class Kind { kBegun, kRows, kAnswered };
  Kind kind;
  std::uint64_t ticket;
  std::string reply;  ///< an encoded ClientReply without request_id
};

struct QueryPoolSettings {
  /// Program of the reader processes (run_reader_program); the default is this program.
  std::string reader_program = "/proc/self/exe";
  QueueSettings queue;
  /// A client that takes none of kChunksAhead chunks for this time loses its answer.
  std::int64_t patience_ms = 10'000;
  /// Longest time of a whole answer, including the time in which it waits for its client.
  std::int64_t longest_answer_ms = 1'800'000;
  std::function<std::int64_t()> now_ms = [] {
    return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::milliseconds(1);
  };
};

/// Most chunks that are sent to a client before it has taken the first of them.
inline constexpr std::uint64_t kChunksAhead = 4;

/// Runs each query in a reader process of its own, which has a memory limit and can be stopped at
/// any time, whatever its statement does. One thread serves all processes.
class QueryPool {
 public:
  using Report = std::function<void(QueryReport)>;

  /// `report` is called on the pool's thread.
  QueryPool(std::string database, QueryPoolSettings settings, Report report);
  ~QueryPool();  ///< calls `stop`
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
  struct Running;

  void run();
  void wait();
  void take_requests();
  bool start_next();
  bool goes_on(Running& query);
  std::string missed_deadline(const Running& query) const;
  void end(std::uint64_t ticket, std::string reply);
  void forget(std::uint64_t ticket);

  const std::string database_;
  const QueryPoolSettings settings_;
  const Report report_;
  const protocol::WakeUp woken_;
  std::mutex mutex_;
  QueryQueue queue_;                              // guarded by mutex_
  std::map<std::uint64_t, std::uint64_t> taken_;  // guarded by mutex_; chunks, by ticket
  bool stopping_ = false;                         // guarded by mutex_
  std::list<Running> running_;                    // used by the thread only
  std::thread thread_;                            // last: it uses the other members
};

/// Argument that makes oblique-server a reader process: `oblique-server --read FILE`.
inline constexpr const char* kReadMode = "--read";

/// Descriptor of a file with the query of a reader process, an encoded QueryRequest.
inline constexpr int kReaderRequest = 3;

/// Precedes each frame on the standard output of a reader process. The frames of an answer are
/// encoded ClientReply messages without request_id.
struct FrameHead {
  std::uint32_t length;
  std::uint32_t is_last;  ///< 1 in the last frame
};

/// Throws std::system_error with errno if a call of the system was not done.
void check_call(bool done, const char* what);

/// Encodes a ClientReply with an error.
std::string encoded_error(const std::string& message, bool wrong_request = false);

/// Starts `program` as a reader process of the database at `path`. It has `request` as
/// kReaderRequest, `answer` as its standard output, no signal blocked or ignored, and a process
/// group of its own: a Ctrl-C on the terminal does not reach it. Throws std::system_error.
pid_t start_reader(const std::string& program, const std::string& path, int request, int answer);

/// Main function of a reader process: answers one query on the database at `path`. First limits its
/// own memory and files. Is killed when the thread that started it ends. Returns the exit code.
int run_reader_program(const std::string& path);

}  // namespace oblique::server
