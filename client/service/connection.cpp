#include "client/service/connection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

/// After this time without a message, a server counts as unreachable.
constexpr std::chrono::milliseconds kSilence{3'000};

std::string seconds_of(std::chrono::milliseconds time) {
  return fmt::format("{} s", solver::exact_number(static_cast<double>(time.count()) / 1000.0));
}

/// Socket settings. An unsent request must not delay the end of the program, so it is dropped.
/// Requests are not queued for an unreachable server, because it would later receive every copy.
/// Reconnection attempts follow quickly, because the embedded service may start after the first
/// attempt.
protocol::DealerSettings dealer_settings(const ConnectionSettings& settings) {
  return {.url = settings.server_url,
          .example_url = ConnectionSettings().server_url,
          .linger_ms = 0,
          .shortest_pause_ms = 20,
          .longest_pause_ms = 1000,
          .queues_unconnected = false,
          .key = settings.key};
}

/// Returns the number after which the next page begins, or 0 after the last page. Also returns 0 if
/// this number is not above the requested one, because the caller's loop would never end.
std::uint64_t next_page(std::uint64_t requested, std::uint64_t answered) {
  return answered > requested ? answered : 0;
}

}  // namespace

/// Stream of an answer that a server sends in chunks.
class ServerRows : public RowStream {
 public:
  ServerRows(Connection& connection, protocol::QueryRequest request) : connection_(connection) {
    connection_.start_rows(std::move(request), {});
  }
  ~ServerRows() override { connection_.end_rows(); }
  ServerRows(const ServerRows&) = delete;
  ServerRows& operator=(const ServerRows&) = delete;

  protocol::QueryReply next() override { return connection_.next_rows(); }

 private:
  Connection& connection_;
};

Connection::Connection(ConnectionSettings settings, KeepWaiting keep_waiting)
    : settings_(std::move(settings)),
      keep_waiting_(std::move(keep_waiting)),
      socket_(protocol::make_dealer(context_, dealer_settings(settings_))),
      monitor_(context_, socket_, dealer_settings(settings_)) {
  protocol::connect(socket_, dealer_settings(settings_));
}

bool Connection::is_unsent(const Outstanding& outstanding) {
  const auto connections = monitor_.connections();
  // A request that was sent over an earlier connection may have been lost with that connection.
  return connections > 0 && outstanding.sent_over != connections;
}

void Connection::send_or_connect_again(Outstanding& outstanding) {
  const auto now = Clock::now();
  if (is_unsent(outstanding) &&
      socket_.send(zmq::buffer(outstanding.frame), zmq::send_flags::dontwait)) {
    outstanding.sent_over = monitor_.connections();
    outstanding.sent = now;
    return;
  }
  // A silent connection may be broken although neither end has noticed.
  const bool has_connected = monitor_.connections() > connections_before_;
  // Each attempt gets more time than the last: a handshake over a slow network takes seconds.
  const auto patience =
      has_connected ? outstanding.resend_after : kSilence * (1U << std::min(failed_attempts_, 2U));
  if (now - std::max(outstanding.sent, connecting_since_) <= patience) {
    return;
  }
  if (has_connected) {
    constexpr std::chrono::milliseconds kLongestPause{60'000};
    outstanding.resend_after = std::min(2 * outstanding.resend_after, kLongestPause);
    failed_attempts_ = 0;
  } else {
    ++failed_attempts_;
    ++attempt_;
  }
  connections_before_ = monitor_.connections();
  connecting_since_ = now;
  socket_.disconnect(settings_.server_url);
  protocol::connect(socket_, dealer_settings(settings_), attempt_);
}

void Connection::wait_a_slice(bool to_send) {
  constexpr std::chrono::milliseconds kLongest{50};
  constexpr std::int64_t kSlices = 5;  // number of slices of a short timeout
  const auto slice = std::min(std::chrono::milliseconds(settings_.timeout_ms / kSlices), kLongest);
  if (keep_waiting_ && !keep_waiting_()) {
    throw Interrupted("stopped while waiting for the server");
  }
  const int events = ZMQ_POLLIN | (to_send ? ZMQ_POLLOUT : 0);
  // Polls the monitor before the socket, so that both refer to the same connection.
  std::array<zmq::pollitem_t, 2> items{{{monitor_.handle(), 0, ZMQ_POLLIN, 0},
                                        {socket_.handle(), 0, static_cast<short>(events), 0}}};
  try {
    zmq::poll(items, slice);
  } catch (const zmq::error_t& error) {
    if (error.num() != EINTR) {
      throw;
    }
  }
}

std::optional<protocol::ClientReply> Connection::received(std::uint64_t request_id) {
  zmq::message_t answer;
  if (!socket_.recv(answer, zmq::recv_flags::dontwait)) {
    return std::nullopt;
  }
  protocol::ClientReply reply;
  if (!protocol::decode(answer.to_string_view(), reply)) {
    throw ConnectionError(fmt::format(
        "the reply from {} is not that of an oblique-server: check the address and port",
        settings_.server_url));
  }
  // Ignores a late or repeated answer to an earlier request.
  if (reply.request_id() != request_id && reply.request_id() != 0) {
    return std::nullopt;
  }
  return reply;
}

protocol::ClientReply Connection::answer_to(const protocol::ClientRequest& request,
                                            Outstanding outstanding, const Tell& tell) {
  const std::chrono::milliseconds timeout(settings_.timeout_ms);
  bool said_silent = false;
  while (tell || Clock::now() - outstanding.heard < timeout) {
    send_or_connect_again(outstanding);
    wait_a_slice(is_unsent(outstanding));
    if (const auto rejection = monitor_.rejection()) {
      throw ConnectionError(*rejection);
    }
    if (auto reply = received(request.request_id())) {
      if (std::exchange(said_silent, false)) {
        tell(fmt::format("{} answers again", settings_.server_url));
      }
      if (!reply->has_still_working()) {
        return *std::move(reply);
      }
      outstanding.runs = reply->still_working().runs();
      outstanding.word = outstanding.sent = Clock::now();
      // A trace, or the check of all points of a study, may take a long time.
      if (tell || request.has_trace() || request.has_submit()) {
        outstanding.heard = outstanding.word;
      }
    }
    if (tell && !said_silent && Clock::now() - outstanding.heard > kSilence) {
      tell(fmt::format("no answer from {} for {}: waiting for it", settings_.server_url,
                       seconds_of(kSilence)));
      said_silent = true;
    }
  }
  throw_no_answer(outstanding);
}

void Connection::throw_no_answer(const Outstanding& outstanding) const {
  const std::string timeout = seconds_of(std::chrono::milliseconds(settings_.timeout_ms));
  if (outstanding.runs && Clock::now() - outstanding.word < kSilence) {
    throw ConnectionError(fmt::format(
        "the query took too long: after {} {} {}. Narrow it, for example with WHERE or LIMIT, or "
        "allow more time with --timeout SECONDS",
        timeout, settings_.server_url,
        *outstanding.runs ? "is still working on it" : "is busy with the queries of others"));
  }
  std::string guess = settings_.if_silent;
  if (guess.empty()) {
    const std::string unknown = address_.error();
    guess =
        fmt::format("{}, or name it with --server URL or OBLIQUE_SERVER",
                    unknown.empty() ? "is a server running there? Start one with `oblique-server`"
                                    : unknown + ". Check it");
  }
  throw ConnectionError(
      fmt::format("no answer from {} within {}: {}", settings_.server_url, timeout, guess));
}

protocol::ClientReply Connection::call(protocol::ClientRequest request, const Tell& tell) {
  end_rows();
  request.set_protocol_version(protocol::kProtocolVersion);
  request.set_request_id(++last_request_id_);
  auto frame = protocol::encode(request);
  if (frame.size() > protocol::kMaxFrameBytes) {
    throw solver::InputError(fmt::format(
        "the request has {} bytes; a server takes at most {}: write long lists of values as ranges",
        frame.size(), protocol::kMaxFrameBytes));
  }
  // A trace may take a long time, and a new connection would make the server start it again.
  const std::chrono::milliseconds resend_after(request.has_trace() ? settings_.timeout_ms
                                                                   : settings_.resend_after_ms);
  auto reply = answer_to(request, {.frame = std::move(frame), .resend_after = resend_after}, tell);
  check(reply, request.kind_case());
  return reply;
}

void Connection::check(const protocol::ClientReply& reply, int kind) const {
  if (reply.has_error() && reply.error().code() == protocol::ERROR_CODE_WRONG_REQUEST) {
    throw solver::InputError(reply.error().message());
  }
  if (reply.has_error()) {
    throw ServerError(reply.error().message());
  }
  // A reply has the kind number of its request. The check also rejects messages of other programs,
  // which may decode as a reply of any kind.
  if (static_cast<int>(reply.kind_case()) != kind) {
    throw ConnectionError(
        fmt::format("the reply from {} is not that of an oblique-server to a client: check the "
                    "address and port ({} is for clients; workers have another port)",
                    settings_.server_url, ConnectionSettings().server_url));
  }
}

std::unique_ptr<RowStream> Connection::rows(protocol::QueryRequest request) {
  return std::make_unique<ServerRows>(*this, std::move(request));
}

std::vector<protocol::QueryReply> Connection::chunks(protocol::QueryRequest request,
                                                     const Tell& tell) {
  start_rows(std::move(request), tell);
  std::vector<protocol::QueryReply> all;
  while (rows_) {
    all.push_back(next_rows());
  }
  return all;
}

protocol::Table Connection::query(const std::string& sql, const Tell& tell) {
  protocol::QueryRequest request;
  request.set_sql(sql);
  protocol::Table whole;
  for (const protocol::QueryReply& chunk : chunks(std::move(request), tell)) {
    protocol::append_rows(chunk, whole);
  }
  return whole;
}

void Connection::start_rows(protocol::QueryRequest request, const Tell& tell) {
  end_rows();
  request.set_time_limit_ms(static_cast<std::uint64_t>(settings_.timeout_ms));
  rows_ = Rows{.request = std::move(request), .tell = tell};
}

protocol::QueryReply Connection::next_rows() {
  protocol::QueryReply chunk;
  if (rows_->chunks > 0) {
    chunk = more_rows();
  } else {
    // Each call ends the current stream.
    Rows rows = *std::exchange(rows_, std::nullopt);
    protocol::ClientRequest request;
    *request.mutable_query() = rows.request;
    chunk = std::move(*call(std::move(request), rows.tell).mutable_query());
    rows.request_id = last_request_id_;
    rows.connection = monitor_.connections();
    rows.columns.assign(chunk.columns().begin(), chunk.columns().end());
    rows_ = std::move(rows);
  }
  if (chunk.chunk() != rows_->chunks + 1 || !protocol::is_sound(chunk) ||
      !std::equal(chunk.columns().begin(), chunk.columns().end(), rows_->columns.begin(),
                  rows_->columns.end())) {
    broke_off(fmt::format("{} sent a wrong part", settings_.server_url));
  }
  ++rows_->chunks;
  rows_->rows += chunk.chunk_rows();
  if (chunk.ends()) {
    rows_.reset();
  }
  return chunk;
}

protocol::QueryReply Connection::more_rows() {
  protocol::ClientRequest request;
  request.mutable_more_rows()->set_request_id(rows_->request_id);
  request.mutable_more_rows()->set_received(rows_->chunks);
  send_about_rows(std::move(request));
  // Does not count time during which this process was stopped or the machine slept.
  constexpr std::chrono::milliseconds kLongestSlice{500};
  const std::chrono::milliseconds timeout(settings_.timeout_ms);
  Clock::duration waited{0};
  while (waited < timeout) {
    const auto before = Clock::now();
    if (auto reply = received(rows_->request_id); reply && !reply->has_still_working()) {
      check(*reply, protocol::ClientRequest::kQuery);
      return std::move(*reply->mutable_query());
    }
    if (monitor_.connections() != rows_->connection) {
      broke_off(fmt::format("the connection to {} was lost", settings_.server_url));
    }
    wait_a_slice(false);
    waited += std::min<Clock::duration>(Clock::now() - before, kLongestSlice);
  }
  broke_off(fmt::format("nothing came from {} for {}", settings_.server_url, seconds_of(timeout)));
}

void Connection::send_about_rows(protocol::ClientRequest request) {
  request.set_protocol_version(protocol::kProtocolVersion);
  // This request has no reply of its own; errors arrive with the request number of the query.
  request.set_request_id(rows_->request_id);
  // If the request cannot be sent, no chunk arrives and the wait times out.
  (void)socket_.send(zmq::buffer(protocol::encode(request)), zmq::send_flags::dontwait);
}

void Connection::end_rows() {
  if (rows_ && rows_->chunks > 0) {
    protocol::ClientRequest request;
    request.mutable_end_query()->set_request_id(rows_->request_id);
    send_about_rows(std::move(request));
  }
  rows_.reset();
}

void Connection::broke_off(const std::string& why) const {
  throw ConnectionError(
      fmt::format("the answer ended after {} rows: {}. Repeat the command", rows_->rows, why));
}

protocol::StatusReply Connection::full_status(const std::string& study, const Tell& tell) {
  protocol::StatusReply all;
  std::uint64_t after = 0;
  do {
    protocol::ClientRequest request;
    request.mutable_status()->set_study(study);
    request.mutable_status()->set_after_study_id(after);
    const protocol::StatusReply page = call(std::move(request), tell).status();
    after = next_page(after, page.next_after());
    all.MergeFrom(page);
  } while (after != 0);
  return all;
}

std::vector<protocol::StudyStatus> Connection::status(const std::string& study, const Tell& tell) {
  const auto reply = full_status(study, tell);
  access_ = reply.access();
  return {reply.studies().begin(), reply.studies().end()};
}

protocol::StudyStatus Connection::status_of(std::uint64_t study_id, const std::string& name,
                                            const Tell& tell) {
  protocol::ClientRequest request;
  request.mutable_status()->set_study(name);  // the server's error contains the name
  request.mutable_status()->set_study_id(study_id);
  const auto reply = call(std::move(request), tell).status();
  if (reply.studies_size() != 1) {
    throw ServerError(fmt::format("the server no longer has the study \"{}\"", name));
  }
  return reply.studies(0);
}

protocol::WorkersReply Connection::workers() {
  protocol::WorkersReply all;
  std::uint64_t after = 0;
  do {
    protocol::ClientRequest request;
    request.mutable_workers()->set_after_worker_id(after);
    const protocol::WorkersReply page = call(std::move(request)).workers();
    after = next_page(after, page.next_after());
    all.MergeFrom(page);
  } while (after != 0);
  return all;
}

protocol::SubmitReply Connection::submit(const Study& study, const SubmitSettings& settings) {
  protocol::ClientRequest request;
  auto& submit = *request.mutable_submit();
  submit.set_name(study.name);
  *submit.mutable_recipe() = study.recipe;
  if (settings.priority) {
    submit.set_priority(*settings.priority);
  }
  submit.set_no_reuse(settings.no_reuse);
  return call(std::move(request)).submit();
}

protocol::TraceReply Connection::trace(protocol::TraceRequest trace) {
  protocol::ClientRequest request;
  *request.mutable_trace() = std::move(trace);
  return call(std::move(request)).trace();
}

protocol::ChangeReply Connection::change(const std::string& study, protocol::StudyChange change,
                                         std::uint64_t study_id, const std::string& new_name) {
  protocol::ClientRequest request;
  request.mutable_change()->set_study(study);
  request.mutable_change()->set_study_id(study_id);
  request.mutable_change()->set_change(change);
  request.mutable_change()->set_new_name(new_name);
  return call(std::move(request)).change();
}

protocol::Recipe Connection::describe(const std::string& study) {
  protocol::ClientRequest request;
  request.mutable_describe()->set_study(study);
  return call(std::move(request)).describe().recipe();
}

namespace {

constexpr const char* kServerVariable = "OBLIQUE_SERVER";
constexpr const char* kKeysVariable = "OBLIQUE_KEYS";

/// Returns the server that a flag or the environment names, or an empty text.
std::string server_named(const SourceFlags& flags) {
  return flags.server.empty() ? environment_variable(kServerVariable).value_or("") : flags.server;
}

std::string seconds(std::int64_t milliseconds) {
  return solver::exact_number(static_cast<double>(milliseconds) / 1000.0);
}

std::int64_t timeout_of(const SourceFlags& flags, std::int64_t default_ms) {
  constexpr double kLongest_s = 1e6;
  if (!flags.timeout_s) {
    return default_ms;
  }
  if (!(*flags.timeout_s > 0.0 && *flags.timeout_s <= kLongest_s)) {
    throw solver::InputError(
        fmt::format("--timeout {} is not allowed: it must be greater than 0 and at most {} s",
                    solver::exact_number(*flags.timeout_s), solver::exact_number(kLongest_s)));
  }
  return std::llround(std::ceil(*flags.timeout_s * 1000.0));
}

}  // namespace

void add_server_flags(CLI::App& command, SourceFlags& flags) {
  command
      .add_option("--server", flags.server,
                  fmt::format("address of the server; default: {}, else {}", kServerVariable,
                              ConnectionSettings().server_url))
      ->type_name("URL");
  command
      .add_option(
          "--keys", flags.keys,
          fmt::format("key file for a server that has keys; default: {}, else none", kKeysVariable))
      ->type_name("FILE");
  command
      .add_option("--timeout", flags.timeout_s,
                  fmt::format("longest wait for an answer [s]; default: {}",
                              seconds(ConnectionSettings().timeout_ms)))
      ->type_name("SECONDS");
}

void add_source_flags(CLI::App& command, SourceFlags& flags) {
  auto* database = command.add_option("--db", flags.database,
                                      fmt::format("database file to read directly; default, unless "
                                                  "a server is named: {} if it is in this folder",
                                                  DatabaseSettings().file));
  database->type_name("FILE");
  flags.may_be_file = true;
  add_server_flags(command, flags);
  command.get_option("--timeout")
      ->description(fmt::format(
          "longest wait for an answer [s]; default: {} from a server, {} from a file",
          seconds(ConnectionSettings().timeout_ms), seconds(DatabaseSettings().timeout_ms)));
  database->excludes("--server");
  database->excludes("--keys");
}

void add_database_argument(CLI::App& command, std::filesystem::path& file) {
  command.add_option("--db,FILE", file, "database file; --db may be omitted")
      ->type_name("FILE")
      ->capture_default_str();
}

ConnectionSettings connection_settings(Console& console, const SourceFlags& flags) {
  ConnectionSettings settings;
  settings.timeout_ms = timeout_of(flags, settings.timeout_ms);
  if (const std::string server = server_named(flags); !server.empty()) {
    settings.server_url = server;
  } else if (flags.may_be_file) {
    settings.if_silent = fmt::format(
        "there is no database {} in this folder, and no server at that address. Name a database "
        "with --db FILE, or a server with --server URL",
        DatabaseSettings().file);
  }
  const std::string keys =
      flags.keys.empty() ? environment_variable(kKeysVariable).value_or("") : flags.keys;
  console.detail(fmt::format("connecting to the server at {}{}", settings.server_url,
                             keys.empty() ? "" : fmt::format(" with the key {}", keys)));
  if (!keys.empty()) {
    settings.key = protocol::read_key_file(keys);
  }
  return settings;
}

std::string database_meant(const SourceFlags& flags) {
  const std::string file = DatabaseSettings().file;
  const bool is_default = server_named(flags).empty() && std::filesystem::exists(file);
  return flags.database.empty() && is_default ? file : flags.database;
}

std::unique_ptr<Source> open_source(Console& console, const SourceFlags& flags,
                                    Connection::KeepWaiting keep_waiting) {
  const auto database_timeout_ms = timeout_of(flags, DatabaseSettings().timeout_ms);
  if (const std::string database = database_meant(flags); !database.empty()) {
    console.detail(fmt::format("reading the database {}", database));
    return open_database(database, database_timeout_ms);
  }
  return std::make_unique<Connection>(connection_settings(console, flags), std::move(keep_waiting));
}

}  // namespace oblique::client
