#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "proto/oblique.pb.h"
#include "server/network/authenticator.h"
#include "server/query/query_pool.h"
#include "server/store/writer.h"

namespace oblique::server {

/// One moment on two clocks.
struct Instant {
  std::int64_t steady_ms;  ///< this clock never runs backwards
  std::int64_t utc_ms;     ///< since 1970
};

/// Formats the time as UTC in ISO 8601 with milliseconds.
std::string iso_8601(Instant now);

/// A client that waits for a reply, and the number of its request.
struct Client {
  std::string identity;  ///< its connection
  std::uint64_t request_id;
  std::shared_ptr<const KeyIdentity> holder = {};  ///< key of the client; null without keys

  /// Returns the name of the client's key; empty without keys.
  std::string key() const { return holder == nullptr ? std::string() : holder->name; }
  bool is_reader() const { return holder != nullptr && holder->role == protocol::Role::kReader; }
  /// Returns the name under which a client takes turns: its key or, without keys, its connection.
  std::string share() const { return holder == nullptr ? identity : "key " + holder->name; }

  bool operator==(const Client&) const = default;
};

/// The error message for requests that a stopping server no longer handles.
inline constexpr const char* kStopping = "the server is stopping: try again after its restart";

enum class Severity { kInfo, kWarning, kError };

/// Interface of the service to network, writer, query pool, check thread and log. The event loop
/// implements it; tests and the simulation replace it. No function blocks or calls the service.
class Ports {
 public:
  /// A function that the service's thread calls with the result of a check.
  using Completion = std::function<void(Instant)>;
  /// A function that runs on the check thread. It must not throw.
  using Check = std::function<Completion()>;

  virtual ~Ports() = default;

  // ---- Network. Frames are encoded messages.
  virtual Delivery to_worker(const std::string& identity, const std::string& frame) = 0;
  /// Returns whether more output waits for the worker than is allowed.
  virtual bool is_busy(const std::string& identity) const = 0;
  /// Returns whether input of the worker was received but not read yet.
  virtual bool has_unread_input(const std::string& /*identity*/) const { return false; }
  /// Returns false if the client has disconnected; the reply is then dropped.
  virtual bool to_client(const std::string& identity, const std::string& frame) = 0;
  /// Adds the keys in use, and the number of refused peers.
  virtual void add_peers(protocol::WorkersReply& /*reply*/) const {}

  // ---- Other threads.
  /// Writes a change. `Service::written` gets the outcome.
  virtual void write(WriteJob job) = 0;
  /// Runs a query. `Service::query_report` gets the answer. Returns false if too many queries wait.
  virtual bool query(QueryJob job) = 0;
  /// Reports that the client has received this number of chunks of its answer.
  virtual void more_rows(std::uint64_t ticket, std::uint64_t received) = 0;
  virtual void cancel_query(std::uint64_t ticket) = 0;
  virtual void run_check(Check check) = 0;

  virtual void log(Severity severity, const std::string& text) = 0;

  // ---- Functions that take messages.
  /// Sends `reply` with the number of the request.
  bool reply(const Client& client, protocol::ClientReply reply);
  bool reply_error(const Client& client, const std::string& message,
                   protocol::ErrorCode code = protocol::ERROR_CODE_FAILED);
  /// Reports to the client that its request waits or runs. Returns false if the client is gone.
  bool reply_still_working(const Client& client, bool runs);
};

protocol::ClientReply error_reply(const std::string& message,
                                  protocol::ErrorCode code = protocol::ERROR_CODE_FAILED);

/// Writes log lines that peers can cause at any rate: at most 20 lines in 10 s, then the number of
/// suppressed lines.
class PeerLog {
 public:
  explicit PeerLog(Ports& ports) : ports_(ports) {}

  /// Writes a line about an admitted worker.
  void write(Severity severity, const std::string& text);
  /// Writes a line about a stranger, such as a refused connection. Lines about strangers have their
  /// own limit, so that they cannot suppress lines about workers.
  void write_of_stranger(const std::string& text);
  /// Counts and logs an invalid frame, which correct peers never send.
  void bad_frame(std::string_view sender);
  /// Must be called several times a second.
  void tick(std::int64_t now_ms);
  std::uint64_t bad_frames() const { return bad_frames_; }

 private:
  static constexpr std::uint64_t kMaxLines = 20;

  Ports& ports_;
  std::uint64_t bad_frames_ = 0;
  std::int64_t span_began_ms_ = 0;
  // Number of lines since `span_began_ms_`, including suppressed lines.
  std::uint64_t lines_ = 0;
  std::uint64_t stranger_lines_ = 0;
};

}  // namespace oblique::server
