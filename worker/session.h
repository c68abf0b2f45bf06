#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
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
  std::string server = "tcp://127.0.0.1:7601";  ///< the server's address for workers
  std::string name;                             ///< name of the worker, in lists
  std::string host;                             ///< name of this machine, in lists
  protocol::WorkerHello hello;                  ///< identifies this process and the one before it
  std::span<SolvingSlot> slots = {};            ///< from make_shared_slots; may be empty
  std::size_t threads = 1;                      ///< number of solving threads
  /// Called several times a second with the state in words.
  std::function<void(const std::string& status)> on_turn;
  std::int64_t report_interval_ms = 100;      ///< maximum delay before solved points are sent
  std::optional<protocol::KeyFile> key = {};  ///< empty: no encryption
  ConversationSettings conversation;
};

/// Runs a worker: the socket on the calling thread, solving on other threads.
class Session {
 public:
  /// `solve` solves points of batches, `trace` points of traces. Does not connect yet.
  Session(SessionSettings settings, BatchSolver::SolvePoints solve, TraceSolver::Solve trace = {});

  /// Runs until the worker is stopped or refused, and returns the exit code. A readable
  /// `stop_descriptor` is a request to stop; `on_stop` must read it, so that a second request can
  /// be recognised. Throws solver::InputError unless `settings.server` is an address.
  int run(int stop_descriptor, const std::function<void()>& on_stop);

  /// Whether the destructor may wait long: for points, or for the lookup of the server's name.
  bool ends_slowly() const {
    return solver_.is_solving() || tracer_.is_solving() || !has_received_;
  }

 private:
  struct Link {
    Link(zmq::context_t& context, const protocol::DealerSettings& settings)
        : socket(protocol::make_dealer(context, settings)), monitor(context, socket, settings) {}
    zmq::socket_t socket;
    protocol::SocketMonitor monitor;
  };

  void open_socket();
  void apply(Effects effects);
  /// False if the socket did not accept the message.
  bool send(const protocol::WorkerMessage& message);
  void receive_all();
  void report_progress();

  const SessionSettings settings_;
  zmq::context_t context_;
  std::optional<Link> link_;
  unsigned attempt_ = 0;      ///< number of sockets without any message; selects IPv4 or IPv6
  bool has_received_ = true;  ///< whether this socket has received a message
  protocol::WakeUp news_;     ///< signalled when a batch ended or a trace is ready
  Conversation conversation_;
  std::optional<int> exit_code_;
  std::int64_t report_due_ms_ = 0;
  BatchSolver solver_;  ///< declared last, with tracer_: their threads use other members
  TraceSolver tracer_;
};

}  // namespace oblique::worker
