#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/point_table.h"
#include "worker/batch.h"

namespace oblique::worker {

// ---- Effects: what the conversation decides and the session carries out -------------------------

/// Drop the socket, if there is one, with all that waits in it, and open a new one.
struct Connect {
  std::string reason;  ///< empty for the first one
};
struct Send {
  protocol::WorkerMessage message;
};
struct Solve {
  Batch batch;
};
/// Drop the batches of the study.
struct DropStudy {
  std::uint64_t study_id;
};
/// Drop that batch.
struct DropBatch {
  std::uint64_t number;
};
/// Drop all batches and traces; the server leases their points anew.
struct DropAll {};
/// Solve that point for a trace, beside the batches.
struct SolveTrace {
  protocol::TraceOrder order;
};
/// No client waits for that trace any more.
struct CancelTrace {
  std::uint64_t trace_id;
};
/// The hello had no answer: log why, as far as the socket shows the cause.
struct ReportUnreachable {};
/// A line for the log.
struct Note {
  std::string text;
  bool is_warning = false;
};
/// The conversation is over.
struct Finish {
  int exit_code;
  std::string reason;
};

using Effect = std::variant<Connect, Send, Solve, DropStudy, DropBatch, DropAll, SolveTrace,
                            CancelTrace, ReportUnreachable, Note, Finish>;
using Effects = std::vector<Effect>;

// ---- Results on their way
// -------------------------------------------------------------------------

/// How much of what is solved is kept and sent.
struct OutboxLimits {
  /// With so many results not acknowledged, or so many bytes of them, no more are solved.
  std::size_t unacknowledged_results = 50'000;
  std::size_t unacknowledged_bytes = std::size_t{64} << 20U;
  /// Of those, so many messages and bytes are on their way at a time; the others wait here, so that
  /// what was solved while the server was away does not come upon it all at once.
  std::size_t messages_on_their_way = 256;
  std::size_t bytes_on_their_way = std::size_t{8} << 20U;
};

/// Results that the server has not acknowledged, in the order of their sequence numbers: those on
/// their way, then those that wait.
class Outbox {
 public:
  explicit Outbox(const OutboxLimits& limits) : limits_(limits) {}

  /// Gives the results the next sequence number and keeps them.
  void add(protocol::Results results);
  /// The next results to send, which are on their way from now on; nothing while none waits or
  /// enough are on their way.
  const protocol::Results* next_to_send();
  /// The server has them. A number that is not kept is passed over.
  void acknowledged(std::uint64_t sequence);
  void drop_study(std::uint64_t study_id);
  void drop_all();
  /// Nothing is on its way any more, nor does any lease end with these results.
  void start_over();

  bool is_empty() const { return unacknowledged_.empty(); }
  /// Whether any results are not even on their way.
  bool has_waiting() const { return on_their_way_ < unacknowledged_.size(); }
  bool is_full() const {
    return results_ >= limits_.unacknowledged_results || bytes_ >= limits_.unacknowledged_bytes;
  }
  std::size_t results() const { return results_; }
  /// Calls `see` with all that are kept.
  template <class See>
  void for_each(const See& see) const {
    for (const Message& message : unacknowledged_) {
      see(message.results);
    }
  }

 private:
  struct Message {
    protocol::Results results;
    std::size_t bytes;
    bool on_its_way;  ///< sent in this session
  };
  void forget(const Message& message);

  const OutboxLimits limits_;
  std::deque<Message> unacknowledged_;
  std::size_t results_ = 0;
  std::size_t bytes_ = 0;
  std::size_t on_their_way_ = 0;        // messages
  std::size_t bytes_on_their_way_ = 0;  // of those
  std::uint64_t next_sequence_ = 1;
};

// ---- The conversation ---------------------------------------------------------------------------

inline constexpr std::int64_t kNever_ms = std::numeric_limits<std::int64_t>::max();

/// When a worker ends by itself.
struct ExitSettings {
  std::int64_t until_ms = kNever_ms;      ///< the process has ended by then; same clock as `now_ms`
  std::string until = {};                 ///< the same as the user wrote it
  std::int64_t idle_exit_ms = kNever_ms;  ///< longest time without work
  std::int64_t shutdown_grace_ms = 3000;  ///< it stops this long before `until_ms`
};

struct ConversationSettings {
  std::uint32_t batches_held = 2;  ///< one is solved, the next waits ready
  OutboxLimits outbox = {};
  std::size_t results_a_message = 1000;
  std::size_t bytes_a_message = std::size_t{64} << 10U;  ///< then another one begins
  std::size_t most_bytes_a_result = std::size_t{1} << 20U;
  std::int64_t hello_timeout_ms = 3000;            ///< a hello without answer is said again
  std::int64_t longest_hello_timeout_ms = 12'000;  ///< doubling up to this
  std::int64_t shortest_backoff_ms = 50;           ///< between failures, doubling
  std::int64_t longest_backoff_ms = 2000;
  std::int64_t shortest_rejected_ms = 2000;  ///< between attempts that the server rejects, doubling
  std::int64_t longest_rejected_ms = 30'000;
  std::int64_t stop_timeout_ms = 2000;  ///< for the last results to be acknowledged
  std::int64_t last_points_ms = 250;    ///< of these: for points that are being solved to end
  /// A request to stop that follows so soon is part of the one before: Slurm sends SIGTERM twice
  /// within milliseconds to jobs that it preempts.
  std::int64_t stop_repeats_ms = 1000;
  ExitSettings exit = {};
};

/// The worker's side of the conversation with the server (proto/protocol.md): decides what follows
/// from each message, from solved points and from the passing of time. No I/O, no clock, no thread.
/// `now_ms` is of any clock that never runs backwards. README.md has the table of states and
/// events.
class Conversation {
 public:
  /// `server` is its address, for messages.
  Conversation(protocol::WorkerHello hello, ConversationSettings settings,
               std::string server = "the server");

  /// To be called once, first.
  Effects start(std::int64_t now_ms);
  Effects on_message(const protocol::ServerToWorker& message, std::int64_t now_ms);
  Effects on_progress(std::vector<Progress> progress, std::int64_t now_ms);
  /// What the tracing of a point gave so far.
  Effects on_traces(std::vector<protocol::Trace> traces, std::int64_t now_ms);
  /// A message could not be sent; what follows it of the same effects must not be sent either.
  Effects on_send_failed(std::int64_t now_ms);
  /// The server has rejected the socket, for a reason that a person must mend.
  Effects on_rejected(const std::string& reason, std::int64_t now_ms);
  /// To be called at `next_deadline_ms` or a little later.
  Effects on_time(std::int64_t now_ms);
  /// Give back what is not solved, deliver what is, say goodbye and finish. While
  /// `points_are_solved` what comes of them within `last_points_ms` is delivered too. A second call
  /// after `stop_repeats_ms` finishes at once.
  Effects stop(std::int64_t now_ms, bool points_are_solved = false);
  /// After a stop: no point is being solved any more, and all that was is reported.
  Effects on_solver_idle(std::int64_t now_ms);
  bool is_stopping() const { return stopping_; }
  /// The state in words, for a service manager.
  std::string status() const;

  std::int64_t next_deadline_ms() const;
  /// Whether further points may be solved: false while too many results wait to be acknowledged.
  bool may_solve() const { return !outbox_.is_full(); }
  std::size_t unacknowledged_results() const { return outbox_.results(); }

 private:
  enum class State {
    kGreeting,  ///< hello was said
    kWaiting,   ///< for the time to try again
    kWelcomed,
    kFinished
  };
  struct Held {
    std::uint64_t study_id;
    std::uint64_t lease_id;
    std::uint32_t attempt;
  };

  void connect(const std::string& reason);
  void connect_after_backoff(const std::string& reason);
  void on(const protocol::Welcome& welcome);
  void on(const protocol::StudyDefinition& definition);
  void on(const protocol::Batch& batch);
  void on(const protocol::ResultsStored& stored);
  void on(const protocol::Withdraw& withdraw);
  void on(const protocol::Release& release);
  void on(const protocol::TraceOrder& order);

  void report(Progress& progress);
  void deliver();
  void send(protocol::WorkerMessage message);
  void send_heartbeat();
  void give_credit();
  std::int64_t exit_ms() const;
  std::int64_t idle_exit_ms() const;
  void exit_if_due();
  void begin_stop(const std::string& reason, bool points_are_solved, int exit_code = 0);
  void exit_by_itself(const std::string& reason);
  void finish_if_delivered();
  void finish(int exit_code, const std::string& reason);
  Effects take_effects();

  const protocol::WorkerHello hello_;
  const ConversationSettings settings_;
  const std::string server_;

  State state_ = State::kWaiting;
  std::int64_t now_ms_ = 0;
  std::int64_t deadline_ms_ = 0;   ///< of the state: hello unanswered, try again, server silent
  std::int64_t hello_timeout_ms_;  ///< of the present attempt
  std::int64_t heartbeat_due_ms_ = 0;
  std::int64_t heartbeat_interval_ms_ = 1000;
  std::int64_t lost_after_ms_ = 3000;
  std::int64_t backoff_ms_ = 0;   ///< 0: the last attempt came to something
  std::int64_t rejected_ms_ = 0;  ///< pause after the last rejection; 0: welcomed since
  std::string rejection_;         ///< what the last one was for; empty: welcomed since
  std::int64_t start_ms_ = 0;
  std::int64_t last_work_ms_ = 0;  ///< when it last had a batch, a trace or results to deliver
  bool was_welcomed_ = false;      ///< ever
  bool stopping_ = false;
  std::string stop_reason_;
  int stop_exit_code_ = 0;
  std::int64_t stop_deadline_ms_ = 0;
  std::int64_t last_points_until_ms_ = 0;
  std::int64_t stop_repeats_until_ms_ = 0;
  bool server_stopping_ = false;
  std::string database_id_;

  std::map<std::uint64_t, std::shared_ptr<const protocol::PointTable>> studies_;
  std::map<std::uint64_t, Held> held_;  // by the batch's number
  std::uint64_t next_batch_ = 1;
  std::uint64_t first_batch_of_database_ = 1;  ///< earlier batches were of another database
  std::uint32_t open_credit_ = 0;              ///< batches asked for and not yet come
  Outbox outbox_;
  Effects effects_;  // of the call being made
};

}  // namespace oblique::worker
