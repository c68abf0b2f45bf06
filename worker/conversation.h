#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/point_table.h"
#include "worker/batch.h"

namespace oblique::worker {

// ---- Effects, which the session carries out -----------------------------------------------------

/// Opens a new socket; closes the present one and drops its queued messages.
struct Connect {
  std::string reason;  ///< why the worker connects again; empty for the first connection
};
struct Send {
  protocol::WorkerMessage message;
};
struct Solve {
  Batch batch;
};
struct DropStudy {
  std::uint64_t study_id;
};
struct DropBatch {
  std::uint64_t number;
};
/// Drops all batches and traces.
struct DropAll {};
struct SolveTrace {
  protocol::TraceOrder order;
};
struct CancelTrace {
  std::uint64_t trace_id;
};
/// A line for the log.
struct Note {
  std::string text;
  bool is_warning = false;
};
struct Finish {
  int exit_code;
  std::string reason;
};

using Effect = std::variant<Connect, Send, Solve, DropStudy, DropBatch, DropAll, SolveTrace,
                            CancelTrace, Note, Finish>;
using Effects = std::vector<Effect>;

// ---- Results until they are acknowledged --------------------------------------------------------

struct OutboxLimits {
  /// Solving pauses at this number of unacknowledged results, or at this number of their bytes.
  std::size_t unacknowledged_results = 50'000;
  std::size_t unacknowledged_bytes = std::size_t{64} << 20U;
  std::size_t messages_on_their_way = 128;  ///< more messages wait until some are acknowledged
};

/// Results that the server has not acknowledged, in the order of their sequence numbers.
class Outbox {
 public:
  explicit Outbox(const OutboxLimits& limits) : limits_(limits) {}

  void add(protocol::Results results);
  /// Returns the next results to send and counts them as sent. Null if none may be sent now.
  const protocol::Results* next_to_send();
  void acknowledged(std::uint64_t sequence);
  void drop_study(std::uint64_t study_id);
  void drop_all();
  /// Marks all results as not sent, and removes their leases.
  void start_over();

  bool is_empty() const { return messages_.empty(); }
  bool has_waiting() const { return on_their_way_ < messages_.size(); }
  bool is_full() const {
    return results_ >= limits_.unacknowledged_results || bytes_ >= limits_.unacknowledged_bytes;
  }
  std::size_t results() const { return results_; }
  /// Adds the lease of each message to `leases`; 0 for a message without a lease.
  void add_leases(std::set<std::uint64_t>& leases) const;

 private:
  struct Message {
    protocol::Results results;
    std::size_t bytes;
  };
  template <class Predicate>
  void remove(const Predicate& is_unwanted);

  const OutboxLimits limits_;
  std::deque<Message> messages_;
  std::size_t results_ = 0;
  std::size_t bytes_ = 0;
  std::size_t on_their_way_ = 0;  ///< number of sent messages; they precede the unsent ones
  std::uint64_t next_sequence_ = 1;
};

// ---- The conversation ---------------------------------------------------------------------------

/// Later than any time; a time can be added without overflow.
inline constexpr std::int64_t kNever_ms = std::numeric_limits<std::int64_t>::max() / 2;

/// When a worker stops by itself.
struct ExitSettings {
  std::int64_t stop_ms = kNever_ms;       ///< time of the stop, by the clock of `now_ms`
  std::string until = {};                 ///< end of the process, as the user wrote it
  std::int64_t idle_exit_ms = kNever_ms;  ///< longest time without work
};

/// A pause or timeout that doubles after each failure.
struct Doubling {
  std::int64_t shortest_ms;
  std::int64_t longest_ms;

  std::int64_t after(std::int64_t last_ms) const {
    return std::clamp(2 * last_ms, shortest_ms, longest_ms);
  }
};

struct ConversationSettings {
  std::uint32_t batches_held = 2;  ///< one batch is solved while another waits
  OutboxLimits outbox = {};
  std::size_t results_a_message = 1000;
  std::size_t bytes_a_message = std::size_t{64} << 10U;  ///< a larger result has its own message
  std::size_t most_bytes_a_result = std::size_t{1} << 20U;
  Doubling hello_timeout{3000, 12'000};
  Doubling backoff{50, 2000};           ///< pause between failures
  Doubling rejection{2000, 30'000};     ///< pause after the server rejects the socket
  std::int64_t stop_timeout_ms = 2000;  ///< time for the server to acknowledge the results
  std::int64_t stop_repeats_ms = 1000;  ///< for this time a second request to stop is ignored
  ExitSettings exit = {};
};

/// The worker's side of the protocol (proto/protocol.md): turns messages, solved points and time
/// into effects. It has no I/O, clock or thread. `now_ms` is the time of any clock that never runs
/// backwards. README.md has the table of states and events.
class Conversation {
 public:
  /// `server` is the address of the server, for log lines.
  Conversation(protocol::WorkerHello hello, ConversationSettings settings,
               std::string server = "the server");

  /// Must be called once, before the other functions.
  Effects start(std::int64_t now_ms);
  Effects on_message(const protocol::ServerToWorker& message, std::int64_t now_ms);
  Effects on_progress(std::vector<Progress> progress, std::int64_t now_ms);
  Effects on_traces(std::vector<protocol::Trace> traces, std::int64_t now_ms);
  /// To be called when a message could not be sent. The caller does not send later messages.
  Effects on_send_failed(std::int64_t now_ms);
  /// To be called when the server has rejected the socket. Only a person can remove the cause.
  Effects on_rejected(const std::string& reason, std::int64_t now_ms);
  /// Must be called at `next_deadline_ms` or soon after.
  Effects on_time(std::int64_t now_ms);
  /// Gives back unsolved points, delivers results, says goodbye and finishes. A second call after
  /// `stop_repeats_ms` finishes at once.
  Effects stop(std::int64_t now_ms);
  /// The state in words, for systemd.
  std::string status() const;

  std::int64_t next_deadline_ms() const;
  /// False while too many results are not acknowledged.
  bool may_solve() const { return !outbox_.is_full(); }
  std::size_t unacknowledged_results() const { return outbox_.results(); }

 private:
  enum class State {
    kGreeting,  ///< sent hello
    kWaiting,   ///< pauses before the next attempt
    kWelcomed,
    kFinished
  };
  struct Held {
    std::uint64_t study_id;
    std::uint64_t lease_id;
  };

  void connect(const std::string& reason);
  void connect_after_backoff(const std::string& reason);
  void wait(std::int64_t duration_ms);
  void handle(const protocol::ServerToWorker& message);
  void on(const protocol::Welcome& welcome);
  void on(const protocol::StudyDefinition& definition);
  void on(const protocol::Batch& batch);
  void on(const protocol::ResultsStored& stored);
  void on(const protocol::Withdraw& withdraw);
  void on(const protocol::Release& release);
  void on(const protocol::TraceOrder& order);

  void report(Progress& progress);
  void add_results(protocol::Results results);
  void deliver();
  void send(protocol::WorkerMessage message);
  void note(std::string text, bool is_warning = false);
  void send_heartbeat();
  void give_credit();
  /// Sends waiting results before it requests batches. Otherwise the server could lease the points
  /// of these results again.
  void go_on();
  std::int64_t idle_exit_ms() const { return last_work_ms_ + settings_.exit.idle_exit_ms; }
  void exit_if_due();
  void begin_stop(const std::string& reason, int exit_code = 0);
  void finish_if_delivered();
  void finish(int exit_code, const std::string& reason);
  Effects take_effects();

  const protocol::WorkerHello hello_;
  const ConversationSettings settings_;
  const std::string server_;

  State state_ = State::kWaiting;
  std::int64_t now_ms_ = 0;
  std::int64_t deadline_ms_ = 0;  ///< end of the present state, unless the server sends a message
  std::int64_t hello_timeout_ms_;
  std::int64_t heartbeat_due_ms_ = 0;
  std::int64_t heartbeat_interval_ms_ = 1000;
  std::int64_t lost_after_ms_ = 3000;
  std::int64_t backoff_ms_ = 0;   ///< pause before the next attempt; 0 after a session with work
  std::int64_t rejected_ms_ = 0;  ///< last pause after a rejection; 0 after a welcome
  std::string rejection_;         ///< reason of the last rejection; empty after a welcome
  std::int64_t start_ms_ = 0;
  std::int64_t last_work_ms_ = 0;  ///< when the worker last had a batch, trace or result
  bool was_welcomed_ = false;      ///< at least once
  bool has_warned_ = false;        ///< true after the warning that no server answers
  bool stopping_ = false;
  std::string stop_reason_;
  int stop_exit_code_ = 0;
  std::int64_t stop_deadline_ms_ = 0;
  std::int64_t stop_repeats_until_ms_ = 0;
  bool server_stopping_ = false;
  std::string database_id_;

  std::map<std::uint64_t, std::shared_ptr<const protocol::PointTable>> studies_;
  std::map<std::uint64_t, std::string> uids_;  ///< of the studies, by number
  std::map<std::uint64_t, Held> held_;         ///< key: number of the batch
  std::uint64_t next_batch_ = 1;
  std::uint64_t first_batch_of_database_ = 1;  ///< earlier batches belong to another database
  std::uint32_t open_credit_ = 0;              ///< batches requested and not received yet
  Outbox outbox_;
  Effects effects_;  ///< collected for the return value of the present call
};

}  // namespace oblique::worker
