#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <zmq.hpp>

#include "client/io/console.h"
#include "client/service/source.h"
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
  /// A request without an answer for this time is sent again over a new connection, and again after
  /// twice the time.
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

/// Sends requests to one server, one at a time. Every call sends one ClientRequest and waits for
/// the reply with its number; each throws ServerError, ConnectionError or Interrupted, and
/// solver::InputError where the server says that the request is wrong.
///
/// Requests are idempotent. One that may be lost with a server that died is sent again to the next
/// one, and so is one without an answer. The first answer counts.
///
/// A call that is given a `tell` never times out: it says once that the server is silent, and once
/// that it answers again. It ends when the server rejects this program, as for its key.
class Connection : public Source {
 public:
  /// Called many times a second while waiting; false ends the wait. It may throw.
  using KeepWaiting = std::function<bool()>;

  /// Connects in the background. Throws solver::InputError for an address that is none.
  explicit Connection(ConnectionSettings settings, KeepWaiting keep_waiting = {});

  const std::string& url() const { return settings_.server_url; }
  std::string place() const override { return url(); }
  std::string access() const override { return access_; }

  /// A connection lost after the first chunk is a ConnectionError, and so is a missing chunk. Any
  /// other call ends the stream.
  std::unique_ptr<RowStream> rows(protocol::QueryRequest request) override;
  /// All chunks of an answer. For answers that fit into memory.
  std::vector<protocol::QueryReply> chunks(protocol::QueryRequest request, const Tell& tell = {});
  using Source::query;
  protocol::Table query(const std::string& sql, const Tell& tell);

  using Source::status;
  std::vector<protocol::StudyStatus> status(const std::string& study, const Tell& tell) override;
  protocol::StudyStatus status_of(std::uint64_t study_id, const std::string& name,
                                  const Tell& tell) override;
  /// The same, with what the server says of itself.
  protocol::StatusReply full_status(const std::string& study = {}, const Tell& tell = {});
  protocol::WorkersReply workers();  ///< all of them

  protocol::SubmitReply submit(const Study& study, const SubmitSettings& settings = {});
  /// Waits as long as the server says that it has the request, whose time limit it keeps.
  protocol::TraceReply trace(protocol::TraceRequest trace);
  /// Changes the study of that name; renaming and deleting also need its number.
  protocol::ChangeReply change(const std::string& study, protocol::StudyChange change,
                               std::uint64_t study_id = 0, const std::string& new_name = {});
  protocol::Recipe describe(const std::string& study);

 private:
  friend class ServerRows;
  using Clock = std::chrono::steady_clock;

  /// An answer in chunks that is not complete.
  struct Rows {
    protocol::QueryRequest request;
    Tell tell = {};                ///< of the first chunk
    std::uint64_t request_id = 0;  ///< after the first chunk
    std::uint64_t connection = 0;  ///< over which the answer comes
    std::uint64_t chunks = 0;      ///< received
    std::uint64_t rows = 0;        ///< received
    std::vector<std::string> columns = {};
  };

  /// A request without an answer so far.
  struct Outstanding {
    std::string frame;
    std::chrono::milliseconds resend_after;  ///< since `sent`
    Clock::time_point heard = Clock::now();  ///< last sign of the server, at first the start
    Clock::time_point sent = Clock::now();   ///< last time, at first the start
    std::uint64_t sent_over = 0;             ///< connection that took it; 0: none has
    Clock::time_point word = {};             ///< last StillWorking
    std::optional<bool> runs = {};           ///< in that: the query runs, or waits
  };

  protocol::ClientReply call(protocol::ClientRequest request, const Tell& tell = {});
  /// Throws what the server's error says, or what is wrong with its reply to a request of `kind`.
  void check(const protocol::ClientReply& reply, int kind) const;
  protocol::ClientReply answer_to(const protocol::ClientRequest& request, Outstanding outstanding,
                                  const Tell& tell);
  [[noreturn]] void throw_no_answer(const Outstanding& outstanding) const;

  void start_rows(protocol::QueryRequest request, const Tell& tell);
  protocol::QueryReply next_rows();
  protocol::QueryReply more_rows();  ///< waits for a chunk after the first
  void end_rows();
  void send_about_rows(protocol::ClientRequest request);
  /// Throws ConnectionError for an answer that broke off, for this reason.
  [[noreturn]] void broke_off(const std::string& why) const;

  /// Whether the present connection has not taken it.
  bool is_unsent(const Outstanding& outstanding);
  /// Sends it over a new connection; connects again after a long silence.
  void send_or_connect_again(Outstanding& outstanding);
  /// Waits for the next frame, a connection, or the end of a slice of time.
  void wait_a_slice(bool to_send);
  /// The next frame from the server, if it is an answer to request `request_id` or says that the
  /// server still works on it.
  std::optional<protocol::ClientReply> received(std::uint64_t request_id);

  ConnectionSettings settings_;
  KeepWaiting keep_waiting_;
  zmq::context_t context_;
  zmq::socket_t socket_;
  protocol::SocketMonitor monitor_;
  unsigned attempt_ = 0;          ///< to connect: which family of addresses is tried
  unsigned failed_attempts_ = 0;  ///< since the last that led to a connection
  Clock::time_point connecting_since_ = Clock::now();
  std::uint64_t connections_before_ = 0;  ///< the present attempt to connect began
  std::uint64_t last_request_id_ = 0;
  std::string access_;
  std::optional<Rows> rows_;
};

/// What --db, --server and --timeout said.
struct SourceFlags {
  std::string database;             ///< empty: not given
  std::string server;               ///< empty: not given
  std::optional<double> timeout_s;  ///< none: the default of what answers
  std::string keys = {};            ///< file; empty: not given
  bool may_be_file = false;         ///< the command has --db
};

/// Adds --server, --keys and --timeout. `flags` must live as long as `command`.
void add_server_flags(CLI::App& command, SourceFlags& flags);
/// Adds --db, --server, --keys and --timeout. `flags` must live as long as `command`.
void add_source_flags(CLI::App& command, SourceFlags& flags);

/// Adds the database file that a command works on, as --db FILE or as a word of its own.
void add_database_argument(CLI::App& command, std::filesystem::path& file);

/// The server that the flags name, else OBLIQUE_SERVER, else the default; and the key of the file
/// that they name, else OBLIQUE_KEYS, else none. Throws solver::InputError for a timeout that is
/// not positive and a key file that cannot be used.
ConnectionSettings connection_settings(Console& console, const SourceFlags& flags);

/// The database that the flags name: --db, or oblique.db when it is in this folder and no server is
/// named; empty: a server is meant.
std::string database_meant(const SourceFlags& flags);

/// Opens the database of `database_meant`, else the server of `connection_settings`, whose answers
/// `keep_waiting` may end the wait for; see Connection.
std::unique_ptr<Source> open_source(Console& console, const SourceFlags& flags,
                                    Connection::KeepWaiting keep_waiting = {});

}  // namespace oblique::client
