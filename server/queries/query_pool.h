#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "proto/system/wake_up.h"
#include "server/queries/query_turns.h"
#include "server/queries/reader_process.h"
#include "server/reading/query_limits.h"

namespace oblique::server {

/// What became of a query.
struct QueryReport {
  enum class Kind {
    kBegun,     ///< it runs now
    kPutBack,   ///< it waits again, behind slow ones
    kRows,      ///< `reply` is a part of the answer; more will come when it is asked for
    kAnswered,  ///< `reply` is all there will be, or the rest
  };
  Kind kind;
  std::uint64_t ticket;
  std::string reply;  ///< the bytes of a ClientReply without request_id: rows, or an error
};

struct QueryPoolSettings {
  /// Program that reads, see reader_program.h; the default is the one that runs.
  std::string reader_program = "/proc/self/exe";
  TurnSettings turns;
  /// A reader ends a query that is over its time itself. One that does not look at the clock is
  /// killed so much later.
  std::int64_t grace_ms = 500;
  /// An answer whose client took nothing for so long, in all, is ended while another query waits
  /// for its reader, or the write-ahead log has grown so long; unless it can be gone on with later.
  std::int64_t patience_ms = 10'000;
  std::uint64_t long_log_bytes = kLongLogBytes;
  std::function<std::int64_t()> clock_ms = {};  ///< of a test; empty: the steady clock
};

/// So many chunks of an answer are given ahead of what its client has taken.
inline constexpr std::uint64_t kChunksAhead = 4;

/// Runs queries in a few reader processes side by side. Only a process can be bounded in memory and
/// stopped at any instant, whatever its statement does. They are started when needed and kept for
/// the next query. One thread looks after them all.
class QueryPool {
 public:
  using Report = std::function<void(QueryReport)>;

  /// `report` is called on the pool's thread. Nothing is started before the first query.
  QueryPool(std::string database, QueryPoolSettings settings, Report report);
  /// Stops.
  ~QueryPool();
  QueryPool(const QueryPool&) = delete;
  QueryPool& operator=(const QueryPool&) = delete;

  /// False when too many queries wait already; see TurnSettings.
  bool submit(QueryJob job);
  /// The client of an answer in chunks has taken so many of them.
  void more(std::uint64_t ticket, std::uint64_t taken);
  /// Nobody wants the answer any more: the query ends, or never begins. It may have been reported.
  void cancel(std::uint64_t ticket);
  /// Kills all readers and ends the thread. What was not answered never will be.
  void stop();

 private:
  struct Slot {
    std::unique_ptr<ReaderProcess> process = {};  // null: it is to be dropped
    std::uint64_t ticket = 0;                     // 0: it waits for a query
    std::int64_t time_limit_ms = 0;
    std::int64_t deadline_ms = 0;
    std::uint64_t given = 0;  // chunks
    bool can_go_on = false;
    bool is_bound = false;
    std::optional<std::int64_t> stands_since_ms = {};  // it may not give more
    std::int64_t stood_ms = 0;                         // in all, before that
  };

  void run();
  void turn();
  std::int64_t time_ms() const;
  void wait(std::int64_t now_ms);
  void take_wishes();
  void drop(std::uint64_t ticket);
  void make_room(std::int64_t now_ms);
  void free_from_idle_clients(std::int64_t now_ms);
  void begin_queries(std::int64_t now_ms);
  void begin(const QueryJob& job, std::int64_t now_ms);
  void look_after(Slot& slot, std::int64_t now_ms);
  bool may_give(const Slot& slot) const;
  void note_standing(Slot& slot, bool stands, std::int64_t now_ms);
  bool give(Slot& slot, std::int64_t now_ms);
  void finish(Slot& slot, std::string reply);
  void end_process(Slot& slot);
  Slot* slot_of(std::uint64_t ticket);
  Slot& idle_slot();
  void forget(std::uint64_t ticket);

  std::string database_;
  QueryPoolSettings settings_;
  Report report_;
  const protocol::WakeUp woken_;
  std::mutex mutex_;
  QueryTurns turns_;                                   // guarded by mutex_
  std::vector<std::uint64_t> unwanted_;                // guarded by mutex_
  std::map<std::uint64_t, std::uint64_t> wishes_;      // guarded by mutex_; chunks taken, by ticket
  bool stopping_ = false;                              // guarded by mutex_
  std::vector<Slot> slots_;                            // of the thread
  std::map<std::uint64_t, std::uint64_t> taken_;       // of the thread; chunks, by ticket
  std::vector<std::unique_ptr<ReaderProcess>> dying_;  // of the thread; killed, not yet gone
  std::thread thread_;                                 // last: it uses all the others
};

}  // namespace oblique::server
