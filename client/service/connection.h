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
#include "proto/address.h"
#include "proto/keys/key_file.h"
#include "proto/oblique.pb.h"
#include "proto/socket/socket.h"
#include "proto/wire/chunk.h"

namespace oblique::client {

/// Address of the server, timeouts and key.
struct ConnectionSettings {
  std::string server_url{"tcp://127.0.0.1:7600"};
  std::int64_t timeout_ms = 10'000;  ///< limit for each answer
  /// Time after which an unanswered request is sent again over a new connection; the time doubles
  /// with each repetition.
  std::int64_t resend_after_ms = 3'000;
  std::optional<protocol::KeyFile> key = {};  ///< our key; without one, messages are not encrypted
  /// Advice if the server does not answer. If empty, the error says that the server may not run.
  std::string if_silent = {};
};

/// The server refused a request or failed; the message comes from the server.
class ServerError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The server gave no readable answer. The message names the remedy.
class ConnectionError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// `keep_waiting` returned false.
class Interrupted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct SubmitSettings {
  /// Studies of higher priority are solved first. Without a value, an existing study keeps its
  /// priority and a new study has 0.
  std::optional<std::int32_t> priority = {};
  bool no_reuse = false;  ///< also solves points whose results another study has
};

/// Sends requests to one server, one at a time. Each call sends one ClientRequest and waits for the
/// reply with the same number. Throws ServerError, ConnectionError, Interrupted, or
/// solver::InputError if the server reports a wrong request. Requests are idempotent: a request
/// without an answer, or lost because the server died, is sent again, and the first answer counts.
/// A call with a `tell` has no timeout: it calls `tell` once when the server is silent and once
/// when the server answers again. It waits until the server answers or rejects this program, for
/// example because of the key.
class Connection : public Source {
 public:
  /// Called many times a second during a wait. The wait ends if it returns false or throws.
  using KeepWaiting = std::function<bool()>;

  /// Connects in the background. Throws solver::InputError for an invalid address.
  explicit Connection(ConnectionSettings settings, KeepWaiting keep_waiting = {});

  const std::string& url() const { return settings_.server_url; }
  std::string place() const override { return url(); }
  std::string access() const override { return access_; }

  /// The stream throws ConnectionError if the connection is lost after the first chunk, or if a
  /// chunk is missing. Any other call on this object ends the stream.
  std::unique_ptr<RowStream> rows(protocol::QueryRequest request) override;
  /// Returns all chunks of an answer. Use it only for answers that fit into memory.
  std::vector<protocol::QueryReply> chunks(protocol::QueryRequest request, const Tell& tell = {});
  using Source::query;
  protocol::Table query(const std::string& sql, const Tell& tell);

  using Source::status;
  std::vector<protocol::StudyStatus> status(const std::string& study, const Tell& tell) override;
  protocol::StudyStatus status_of(std::uint64_t study_id, const std::string& name,
                                  const Tell& tell) override;
  /// Returns the status of studies, with information about the server.
  protocol::StatusReply full_status(const std::string& study = {}, const Tell& tell = {});
  protocol::WorkersReply workers();  ///< all workers

  protocol::SubmitReply submit(const Study& study, const SubmitSettings& settings = {});
  /// Waits while the server reports that it works on the trace. The server limits the time.
  protocol::TraceReply trace(protocol::TraceRequest trace);
  /// Changes the study called `study`. Renaming and deleting also need the number of the study.
  protocol::ChangeReply change(const std::string& study, protocol::StudyChange change,
                               std::uint64_t study_id = 0, const std::string& new_name = {});
  protocol::Recipe describe(const std::string& study);

 private:
  friend class ServerRows;
  using Clock = std::chrono::steady_clock;

  /// Progress of an answer in chunks that is not yet complete.
  struct Rows {
    protocol::QueryRequest request;
    Tell tell = {};                ///< receives messages during the wait for the first chunk
    std::uint64_t request_id = 0;  ///< valid after the first chunk
    std::uint64_t connection = 0;  ///< connection that delivers the answer
    std::uint64_t chunks = 0;      ///< chunks received
    std::uint64_t rows = 0;        ///< rows received
    std::vector<std::string> columns = {};
  };

  struct Outstanding {
    std::string frame;
    std::chrono::milliseconds resend_after;  ///< since `sent`
    /// Start of the timeout: creation of this object, or a StillWorking that renews the timeout.
    Clock::time_point heard = Clock::now();
    Clock::time_point sent = Clock::now();  ///< time of the last sending or StillWorking
    std::uint64_t sent_over = 0;            ///< connection that sent the request; 0 if unsent
    Clock::time_point word = {};            ///< time of the last StillWorking message
    std::optional<bool> runs = {};  ///< `runs` of the last StillWorking: false if the query waits
  };

  protocol::ClientReply call(protocol::ClientRequest request, const Tell& tell = {});
  /// Throws the server's error as an exception. Throws ConnectionError if the reply does not match
  /// a request of `kind`.
  void check(const protocol::ClientReply& reply, int kind) const;
  protocol::ClientReply answer_to(const protocol::ClientRequest& request, Outstanding outstanding,
                                  const Tell& tell);
  [[noreturn]] void throw_no_answer(const Outstanding& outstanding) const;

  void start_rows(protocol::QueryRequest request, const Tell& tell);
  protocol::QueryReply next_rows();
  protocol::QueryReply more_rows();  ///< waits for each chunk after the first
  void end_rows();
  void send_about_rows(protocol::ClientRequest request);
  /// Throws a ConnectionError for an incomplete answer.
  [[noreturn]] void broke_off(const std::string& why) const;

  /// Whether the request has not been sent over the present connection.
  bool is_unsent(const Outstanding& outstanding);
  /// Sends the request over a new connection, or reconnects after a long silence.
  void send_or_connect_again(Outstanding& outstanding);
  /// Waits for the next message or connection, at most for one time slice.
  void wait_a_slice(bool to_send);
  /// Returns the next message from the server if it answers this request or is StillWorking.
  std::optional<protocol::ClientReply> received(std::uint64_t request_id);

  ConnectionSettings settings_;
  KeepWaiting keep_waiting_;
  protocol::AddressLookup address_{settings_.server_url};
  zmq::context_t context_;
  zmq::socket_t socket_;
  protocol::SocketMonitor monitor_;
  unsigned attempt_ = 0;          ///< attempts to connect; they alternate between address families
  unsigned failed_attempts_ = 0;  ///< failed attempts since the last successful one
  Clock::time_point connecting_since_ = Clock::now();
  std::uint64_t connections_before_ = 0;  ///< number of connections before the present attempt
  std::uint64_t last_request_id_ = 0;
  std::string access_;
  std::optional<Rows> rows_;
};

/// Values of --db, --server, --keys and --timeout.
struct SourceFlags {
  std::string database;             ///< database file; empty if not given
  std::string server;               ///< address of the server; empty if not given
  std::optional<double> timeout_s;  ///< time limit of an answer; empty if not given
  std::string keys = {};            ///< key file; empty if not given
  bool may_be_file = false;         ///< whether the command has --db
};

/// Adds --server, --keys and --timeout. `flags` must live as long as `command`.
void add_server_flags(CLI::App& command, SourceFlags& flags);
/// Adds --db, --server, --keys and --timeout. `flags` must live as long as `command`.
void add_source_flags(CLI::App& command, SourceFlags& flags);

/// Adds the database file of a command, as --db FILE or as an argument without a flag.
void add_database_argument(CLI::App& command, std::filesystem::path& file);

/// Returns the settings for a connection. The server is the one that the flags name, else
/// OBLIQUE_SERVER, else the default; the key is from the file that the flags name, else
/// OBLIQUE_KEYS, else there is none. Throws solver::InputError for a timeout that is not positive
/// and for an unusable key file.
ConnectionSettings connection_settings(Console& console, const SourceFlags& flags);

/// Returns the database file that --db names, or else, if no server is named, oblique.db in the
/// current folder if it exists. An empty path means that the command uses a server.
std::string database_meant(const SourceFlags& flags);

/// Opens the database of `database_meant`, or else the server of `connection_settings`.
/// `keep_waiting` is the same as in Connection.
std::unique_ptr<Source> open_source(Console& console, const SourceFlags& flags,
                                    Connection::KeepWaiting keep_waiting = {});

}  // namespace oblique::client
