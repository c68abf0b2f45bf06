#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>

#include <zmq.hpp>

#include "proto/keys/key_file.h"
#include "proto/socket/socket.h"
#include "proto/system/descriptor.h"
#include "worker/batch_solver.h"
#include "worker/conversation.h"
#include "worker/trace_solver.h"

namespace oblique::worker {

/// Settings of the worker; help texts print the defaults from here.
struct SessionSettings {
  std::string server = "tcp://127.0.0.1:7601";  ///< where the server awaits workers
  std::string name;                             ///< for people
  std::string host;                             ///< name of this machine, for people
  std::size_t threads = 1;                      ///< that solve points
  std::function<void()> on_turn;                ///< called several times a second
  std::int64_t report_interval_ms = 100;        ///< solved points wait at most so long
  std::optional<protocol::KeyFile> key = {};    ///< its own; none: plain text
  ConversationSettings conversation;
};

/// Runs a worker: the socket and the heartbeats on the calling thread, solving on others.
class Session {
 public:
  /// Solves points of batches by `solve`, and those that somebody wants to look at by `trace`.
  /// Connects to nothing yet.
  Session(SessionSettings settings, BatchSolver::SolvePoints solve, TraceSolver::Solve trace = {});
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Runs until the worker is stopped or refused, and returns the exit code.
  /// Stops when `stop_descriptor` is readable; reading it is left to `on_stop`, so that a second
  /// request can be told from the first. Throws solver::InputError unless `settings.server` is an
  /// address.
  int run(int stop_descriptor, const std::function<void()>& on_stop);

  /// Where the conversation is, as a sentence part.
  std::string status() const { return conversation_.status(); }

  /// Whether a point is still being solved: destruction would wait for it.
  bool is_solving() const { return solver_.is_solving() || tracer_.is_solving(); }

 private:
  /// The socket of the present attempt.
  struct Link {
    Link(zmq::context_t& context, const protocol::DealerSettings& settings)
        : socket(protocol::make_dealer(context, settings)),
          monitor(context, socket, settings, true) {}
    zmq::socket_t socket;
    protocol::SocketMonitor monitor;
  };

  void open_socket();
  void report_unreachable();
  void apply(Effects effects);
  /// False when the message could not be handed to the socket.
  bool send(const protocol::WorkerMessage& message);
  void receive_all();
  void report_progress();

  const SessionSettings settings_;
  zmq::context_t context_;
  std::optional<Link> link_;
  unsigned attempt_ = 0;   ///< to connect: which of the families of addresses the host has is tried
  bool was_heard_ = true;  ///< something came over this socket
  std::set<std::string> reported_causes_;  ///< of the server's silence, since it last welcomed us
  protocol::WakeUp news_;                  ///< a batch ended, or there is more of a trace
  Conversation conversation_;
  std::optional<int> exit_code_;
  std::int64_t report_due_ms_ = 0;
  BatchSolver solver_;  // these two last: their threads use the ones above
  TraceSolver tracer_;
};

}  // namespace oblique::worker
