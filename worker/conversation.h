#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/recipe.h"
#include "worker/task.h"

namespace oblique::worker {

/// What the conversation with the server keeps to.
struct ConversationSettings {
  std::uint32_t batches_held = 2;  ///< one is solved, the next waits ready
  /// With so many results not acknowledged, or so many bytes of them, no more are solved.
  std::size_t unacknowledged_limit = 50'000;
  std::size_t unacknowledged_bytes_limit = std::size_t{64} << 20U;
  /// Of those, so many messages and bytes are on their way at a time; the others wait here, so that
  /// what was solved while the server was away does not come upon it all at once.
  std::size_t messages_on_their_way = 256;
  std::size_t bytes_on_their_way = std::size_t{8} << 20U;
  std::size_t results_a_message = 1000;
  std::size_t bytes_a_message = std::size_t{1} << 20U;
  std::int64_t hello_timeout_ms = 3000;   ///< a hello without answer is said again
  std::int64_t shortest_backoff_ms = 50;  ///< between failures, doubling
  std::int64_t longest_backoff_ms = 2000;
  std::int64_t stop_timeout_ms = 2000;  ///< for the last results to be acknowledged
};

// ---- Effects ------------------------------------------------------------------------------------

/// Drop the socket, if there is one, with all that waits in it, and open a new one.
struct Connect {
  std::string reason;  ///< empty for the first one
};
struct Send {
  protocol::WorkerMessage message;
};
struct Solve {
  Task task;
};
/// Drop the tasks of the study.
struct DropStudy {
  std::uint64_t study_id;
};
/// Drop that task.
struct DropTask {
  std::uint64_t number;
};
/// Drop all tasks: whoever gets their points now is the server's to say.
struct DropAll {};
/// Worth a line in the log.
struct Note {
  std::string text;
};
/// The conversation is over.
struct Finish {
  int exit_code;
  std::string reason;
};

using Effect = std::variant<Connect, Send, Solve, DropStudy, DropTask, DropAll, Note, Finish>;
using Effects = std::vector<Effect>;

/// The worker's side of the conversation with the server (proto/protocol.md): decides what follows
/// from each message, from solved points and from the passing of time. No I/O, no clock, no thread.
/// `now_ms` is of any clock that never runs backwards. README.md has the table of states and
/// events.
class Conversation {
 public:
  Conversation(protocol::WorkerHello hello, ConversationSettings settings);

  /// To be called once, first.
  Effects start(std::int64_t now_ms);
  Effects on_message(const protocol::ServerToWorker& message, std::int64_t now_ms);
  Effects on_progress(std::vector<Progress> progress, std::int64_t now_ms);
  /// A message could not be sent; what follows it of the same effects must not be sent either.
  Effects on_send_failed(std::int64_t now_ms);
  /// To be called at `next_deadline_ms` or a little later.
  Effects on_time(std::int64_t now_ms);
  /// Deliver what is solved, say goodbye and finish. A second call finishes at once.
  Effects stop(std::int64_t now_ms);

  std::int64_t next_deadline_ms() const;
  /// Whether further points may be solved: false while too many results wait to be acknowledged.
  bool may_solve() const;
  std::size_t unacknowledged_results() const { return unacknowledged_results_; }

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
  void on(const protocol::Refused& refused);
  void on(const protocol::StudyDefinition& definition);
  void on(const protocol::Batch& batch);
  void on(const protocol::ResultsStored& stored);
  void on(const protocol::Withdraw& withdraw);
  void on(const protocol::Release& release);
  void on(const protocol::HelloAgain& again);
  void on(const protocol::HeartbeatReply& reply);
  void on(const protocol::ServerStopping& stopping);

  void report(Progress& progress);
  void queue_results(protocol::Results results);
  void deliver();
  void send(protocol::WorkerMessage message);
  void send_heartbeat();
  void give_credit();
  void finish_if_delivered();
  void finish(int exit_code, const std::string& reason);
  Effects take_effects();

  const protocol::WorkerHello hello_;
  const ConversationSettings settings_;

  State state_ = State::kWaiting;
  std::int64_t now_ms_ = 0;
  std::int64_t deadline_ms_ = 0;  ///< of the state: hello unanswered, try again, server silent
  std::int64_t heartbeat_due_ms_ = 0;
  std::int64_t heartbeat_interval_ms_ = 1000;
  std::int64_t lost_after_ms_ = 3000;
  std::int64_t backoff_ms_ = 0;  ///< 0: the last attempt came to something
  bool stopping_ = false;
  std::int64_t stop_deadline_ms_ = 0;
  bool server_stopping_ = false;
  std::string database_id_;

  std::map<std::uint64_t, std::shared_ptr<const protocol::PointTable>> studies_;
  std::map<std::uint64_t, Held> held_;  // by the task's number
  std::uint64_t next_task_ = 1;
  std::uint64_t first_task_of_database_ = 1;  ///< earlier tasks were of another database
  std::uint32_t open_credit_ = 0;             ///< batches asked for and not yet come

  struct Unacknowledged {
    protocol::Results results;
    std::size_t bytes;
    bool on_its_way;  // sent in this session
  };
  void forget(std::deque<Unacknowledged>::const_iterator results);

  std::deque<Unacknowledged> unacknowledged_;  // by sequence; those on their way come first
  std::size_t unacknowledged_results_ = 0;
  std::size_t unacknowledged_bytes_ = 0;
  std::size_t on_their_way_ = 0;        // messages
  std::size_t bytes_on_their_way_ = 0;  // of those
  std::uint64_t next_sequence_ = 1;
  Effects effects_;  // of the call being made
};

}  // namespace oblique::worker
