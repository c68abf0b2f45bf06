#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <zmq.hpp>

#include "client/study/study.h"
#include "proto/keys/key_file.h"
#include "proto/oblique.pb.h"
#include "proto/socket/socket.h"
#include "proto/wire/chunk.h"

namespace oblique::client {

/// Where the server is, and how long to wait for it.
struct ConnectionSettings {
  std::string server_url{"tcp://127.0.0.1:7600"};
  std::int64_t timeout_ms = 10'000;  ///< for one answer
  /// A request of which nothing was heard for so long is sent again over a new connection, and
  /// again after twice as long.
  std::int64_t resend_after_ms = 3'000;
  std::optional<protocol::KeyFile> key = {};  ///< ours; none: plain text
  /// What to say of a server that does not answer; empty: that there may be none.
  std::string if_silent = {};
};

/// The server answered that it cannot or will not; the message is its own.
class ServerError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// No answer that can be read. The message says what to do.
class ConnectionError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The waiting was ended by `keep_waiting`.
class Interrupted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct SubmitSettings {
  /// Studies of a higher one come first. Not given: a known study keeps its own, a new one has 0.
  std::optional<std::int32_t> priority = {};
  bool no_reuse = false;  ///< solves also the points of which other studies have results
};

/// Takes in a sentence for people.
using Tell = std::function<void(const std::string& sentence)>;

/// Asks one server, one question at a time. Every call sends one ClientRequest and waits for the
/// reply with its number; each throws ServerError, ConnectionError or Interrupted, and
/// solver::InputError where the server says that the fault is in what was asked.
///
/// Requests are idempotent. One that a server may have taken with it when it died is sent again, as
/// soon as a server is there again; so is one of which nothing is heard. Of several answers the
/// first counts.
///
/// A call that is given a `tell` does not end for want of an answer: it says once that the server
/// is silent, and once that it answers again. It ends, as any other, when the server turns this
/// program away, as for its key.
class Connection {
 public:
  /// Asked many times a second while waiting; false ends the wait. It may throw.
  using KeepWaiting = std::function<bool()>;

  /// Connects in the background. Throws solver::InputError for an address that is none.
  explicit Connection(ConnectionSettings settings, KeepWaiting keep_waiting = {});

  const std::string& url() const { return settings_.server_url; }

  /// What the server says of itself, with one study at most.
  protocol::StatusReply greeting();
  protocol::SubmitReply submit(const Study& study, const SubmitSettings& settings = {});
  /// The study of that name, or all of them when it is empty, however many pages they fill.
  protocol::StatusReply status(const std::string& study, const Tell& tell = {});
  /// The same of one study by its number, whatever it is called by now; errors call it `study`.
  protocol::StatusReply status_of(const std::string& study, std::uint64_t study_id,
                                  const Tell& tell = {});
  /// All workers, likewise.
  protocol::WorkersReply workers();
  /// Waits for as long as the server says that it has the request, whose time limit it keeps.
  protocol::TraceReply trace(protocol::TraceRequest trace);
  protocol::ChangeReply change(const std::string& study, protocol::StudyChange change);
  /// Gives the study of that number, as `status` has it, another name.
  protocol::ChangeReply rename(const protocol::StudyStatus& study, const std::string& name);
  /// Deletes it with its results.
  protocol::ChangeReply remove(const protocol::StudyStatus& study);
  protocol::Recipe describe(const std::string& study);
  /// The whole answer to one statement that only reads. For answers that fit into memory.
  protocol::Table query(const std::string& sql, const Tell& tell = {});

  /// The chunks of the answer to a question, all of them. For answers that fit into memory.
  std::vector<protocol::QueryReply> chunks(protocol::QueryRequest request, const Tell& tell = {});

  /// Asks for an answer in chunks. It is given by `next_rows` and ended by `end_rows`, or by any
  /// other request.
  void ask_for_rows(protocol::QueryRequest request);
  /// The next chunk of it, the first being asked for again over a new connection as any answer. A
  /// connection that is lost after that is a ConnectionError, and so is a chunk that is missing.
  protocol::QueryReply next_rows();
  /// Nothing more of it is wanted.
  void end_rows();

 private:
  using Clock = std::chrono::steady_clock;

  /// An answer in chunks.
  struct Rows {
    protocol::ClientRequest request;
    std::uint64_t connection = 0;  ///< over which it comes
    std::uint64_t chunks = 0;      ///< that were given
    std::uint64_t rows = 0;
    std::vector<std::string> columns = {};
    Tell tell = {};  ///< of the first chunk
  };

  /// A request that is not answered yet.
  struct Outstanding {
    std::string frame;
    Clock::time_point heard;                 ///< when the server last gave a sign, or the start
    std::chrono::milliseconds resend_after;  ///< since `sent`
    Clock::time_point sent;                  ///< when it was last sent, or the start
    std::uint64_t sent_over = 0;             ///< connection that took it; 0: none has
    Clock::time_point word = {};             ///< when the server last said that it has it
    std::optional<bool> runs = {};           ///< what it said: the query runs, or waits
  };

  protocol::ClientReply call(protocol::ClientRequest request, const Tell& tell = {});
  /// The same, and numbers the request.
  protocol::ClientReply call_numbered(protocol::ClientRequest& request, const Tell& tell);
  /// Throws what the server's error says, or what is wrong with its reply.
  void check(const protocol::ClientReply& reply, const protocol::ClientRequest& request) const;
  protocol::ClientReply answer_to(const protocol::ClientRequest& request, Outstanding outstanding,
                                  const Tell& tell);
  /// Waits for a chunk after the first.
  protocol::QueryReply more_rows();
  void tell_of_rows(const protocol::ClientRequest& wish);
  /// Throws ConnectionError for an answer that broke off, for this reason.
  [[noreturn]] void broke_off(const std::string& why) const;
  /// Whether no connection has taken it, or only one that there was before the present one.
  bool is_unsent(const Outstanding& outstanding);
  /// Sends it if a connection takes it that has not yet; connects again when nothing was heard for
  /// long.
  void send_or_connect_again(Outstanding& outstanding);
  /// Waits for the next frame, a connection, or the end of a slice of time.
  void wait_a_slice(bool to_send);
  /// The server has the query and works on it. For a call that waits for ever that is sign enough.
  static void note_word(Outstanding& outstanding, const protocol::StillWorking& word,
                        bool counts_as_answer);
  /// The next frame from the server, if it is an answer to request `request_id` or says that the
  /// server works on it still.
  std::optional<protocol::ClientReply> received(std::uint64_t request_id);

  ConnectionSettings settings_;
  KeepWaiting keep_waiting_;
  zmq::context_t context_;
  zmq::socket_t socket_;
  protocol::SocketMonitor monitor_;
  unsigned attempt_ = 0;           ///< to connect: which family of addresses is tried
  unsigned attempts_in_vain_ = 0;  ///< since the last that led to a connection
  Clock::time_point connecting_since_ = Clock::now();
  std::uint64_t connections_before_ = 0;  ///< the present attempt to connect began
  std::uint64_t last_request_id_ = 0;
  std::optional<Rows> rows_;  ///< under way
};

}  // namespace oblique::client
