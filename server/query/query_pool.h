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
  std::string client;    ///< name of the client's key or, without keys, ID of its connection
  protocol::QueryRequest request;
  std::size_t bytes = 0;  ///< memory of the request; QueryQueue sets it
};

struct QueueSettings {
  std::size_t readers = limits::kRunningQueries;  ///< maximum number of running queries
  /// maximum number of running queries per client
  std::size_t most_running_each = limits::kRunningQueriesOfClient;
  std::size_t most_waiting = limits::kWaitingQueries;  ///< maximum number of waiting queries
  /// maximum number of waiting queries per client
  std::size_t most_waiting_each = limits::kWaitingQueriesOfClient;
  /// maximum memory of waiting requests [bytes]
  std::size_t most_waiting_bytes = limits::kWaitingQueryBytes;
};

/// Chooses the next query: round-robin over clients, in order of arrival within one client.
class QueryQueue {
 public:
  explicit QueryQueue(QueueSettings settings) : settings_(settings) {}

  /// Returns false and drops the job if too many queries wait.
  bool add(QueryJob job);
  /// Returns the next query that may run; it counts as running until `remove`.
  std::optional<QueryJob> start_next();
  /// Removes a waiting or running query. Ignores unknown tickets.
  void remove(std::uint64_t ticket);

 private:
  using Running = std::map<std::uint64_t, std::string>;

  QueueSettings settings_;
  std::deque<QueryJob> waiting_;  // jobs of the client whose turn is next come first
  Running running_;               // clients of running queries, by ticket
};

/// Progress of a query. kBegun: it has started to run. kRows: `reply` is a chunk of the answer.
/// kAnswered: `reply` is the last chunk or an error.
struct QueryReport {
  enum class Kind { kBegun, kRows, kAnswered };
  Kind kind;
  std::uint64_t ticket;
  std::string reply;  ///< an encoded ClientReply without request_id
};

struct QueryPoolSettings {
  /// Program of the reader processes (run_reader_program). The default is this program.
  std::string reader_program = "/proc/self/exe";
  QueueSettings queue;
  /// A client that receives none of kChunksAhead chunks within this time loses its answer.
  std::int64_t patience_ms = 10'000;
  /// Maximum time for a whole answer, including the time that the client takes.
  std::int64_t longest_answer_ms = 1'800'000;
  std::function<std::int64_t()> now_ms = [] {
    return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::milliseconds(1);
  };
};

/// Maximum number of chunks sent ahead of those that the client has received.
inline constexpr std::uint64_t kChunksAhead = 4;

/// Runs each query in a reader process of its own, which has a memory limit and can be killed at
/// any time. One thread serves all processes.
class QueryPool {
 public:
  using Report = std::function<void(QueryReport)>;

  /// `report` is called on the pool's thread.
  QueryPool(std::string database, QueryPoolSettings settings, Report report);
  ~QueryPool();  ///< calls `stop`
  QueryPool(const QueryPool&) = delete;
  QueryPool& operator=(const QueryPool&) = delete;

  /// Returns false if too many queries wait (QueueSettings).
  bool submit(QueryJob job);
  /// Reports that the client has received the first `received` chunks of its answer.
  void more(std::uint64_t ticket, std::uint64_t received);
  /// Ends a query or removes it from the queue. Its reports may still arrive.
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
  QueryQueue queue_;  // guarded by mutex_
  // guarded by mutex_; number of received chunks, by ticket
  std::map<std::uint64_t, std::uint64_t> received_chunks_;
  bool stopping_ = false;       // guarded by mutex_
  std::list<Running> running_;  // used only by the pool's thread
  // declared last, because it uses the other members
  std::thread thread_;
};

/// Argument with which oblique-server runs as a reader process: `oblique-server --read FILE`.
inline constexpr const char* kReadMode = "--read";

/// File descriptor from which a reader process reads its query, an encoded QueryRequest.
inline constexpr int kReaderRequest = 3;

/// Header of each frame on the standard output of a reader process. The frames of an answer are
/// encoded ClientReply messages without request_id.
struct FrameHead {
  std::uint32_t length;
  std::uint32_t is_last;  ///< 1 in the last frame
};

/// Throws std::system_error with errno if `done` is false.
void check_call(bool done, const char* what);

std::string encoded_error(const std::string& message,
                          protocol::ErrorCode code = protocol::ERROR_CODE_FAILED);

/// Starts `program` as a reader process for the database at `path`. Its descriptor kReaderRequest
/// becomes `request` and its standard output `answer`. No signal is blocked or ignored in it. It
/// has its own process group, so Ctrl-C on the terminal does not reach it. Throws
/// std::system_error.
pid_t start_reader(const std::string& program, const std::string& path, int request, int answer);

/// Main function of a reader process: limits its own memory and files, and answers one query on the
/// database at `path`. The process is killed when the thread that started it ends. Returns the exit
/// code.
int run_reader_program(const std::string& path);

}  // namespace oblique::server
