#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>

#include <zmq.hpp>

#include "client/axis.h"
#include "proto/oblique.pb.h"

namespace oblique::client {

/// Where the server is, and how long to wait for it.
struct ConnectionSettings {
  std::string server_url{"tcp://127.0.0.1:7600"};
  std::int64_t timeout_ms = 10'000;  ///< for one answer
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

/// How a study uses the workers of its server.
struct StudyTerms {
  // What is not given stays as it is for a study that the server knows.
  std::optional<std::int32_t> priority = {};  ///< studies of a higher one come first
  std::optional<double> weight = {};          ///< share of the workers among those of one priority
  bool mixes_versions = false;                ///< workers of any solver version take part
};

/// Asks one server, one question at a time. Every call sends one ClientRequest and waits for the
/// reply with its number; each throws ServerError, ConnectionError or Interrupted.
class Connection {
 public:
  /// Asked many times a second while waiting; false ends the wait. It may throw.
  using KeepWaiting = std::function<bool()>;

  /// Connects in the background. Throws solver::InputError for an address that is none.
  explicit Connection(ConnectionSettings settings, KeepWaiting keep_waiting = {});

  const std::string& url() const { return settings_.server_url; }

  protocol::SubmitReply submit(const Study& study, const StudyTerms& terms = {});
  /// The study of that name, or all of them when it is empty.
  protocol::StatusReply status(const std::string& study);
  protocol::WorkersReply workers();
  protocol::ChangeReply change(const std::string& study, protocol::StudyChange change);
  /// Runs one statement that only reads; `max_rows` 0 leaves the limit to the server.
  protocol::QueryReply query(const std::string& sql, std::uint64_t max_rows = 0);

 private:
  protocol::ClientReply call(protocol::ClientRequest request);
  /// Waits for the next frame until `deadline`; false when none came.
  bool wait_for_frame(std::chrono::steady_clock::time_point deadline);

  ConnectionSettings settings_;
  KeepWaiting keep_waiting_;
  zmq::context_t context_;
  zmq::socket_t socket_;
  std::uint64_t last_request_id_ = 0;
};

}  // namespace oblique::client
