#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <sys/eventfd.h>
#include <unistd.h>

#include <gtest/gtest.h>
#include <zmq.hpp>

#include "proto/frames.h"
#include "proto/result_message.h"
#include "proto/wire/chunk.h"
#include "server/event_loop/event_loop.h"
#include "server/query/reader.h"
#include "tests/support/hang_limit.h"
#include "tests/support/points.h"

namespace oblique::server {

using protocol::ClientReply;
using protocol::ClientRequest;
using protocol::ServerToWorker;
using protocol::WorkerMessage;

/// Runs a server on ports chosen by the system; the destructor stops it.
class RunningServer {
 public:
  explicit RunningServer(const std::string& database, QueueSettings queue = {},
                         NetworkLimits network = {}, const ClientHandlerSettings& clients = {},
                         const AccessSettings& access = {},
                         const std::optional<WebSettings>& web = {})
      : loop_(settings(database, queue, network, clients, access, web)) {
    thread_ = std::thread([this] { end_ = loop_.run(stop_fd_); });
  }
  ~RunningServer() { stop(); }
  RunningServer(const RunningServer&) = delete;
  RunningServer& operator=(const RunningServer&) = delete;

  LoopEnd stop() {
    if (thread_.joinable()) {
      const std::uint64_t one = 1;
      EXPECT_EQ(::write(stop_fd_, &one, sizeof one), static_cast<ssize_t>(sizeof one));
      thread_.join();
      ::close(stop_fd_);
    }
    return end_;
  }
  std::string client_endpoint() const { return loop_.client_endpoint(); }
  std::string worker_endpoint() const { return loop_.worker_endpoint(); }
  std::string http_url() const { return loop_.http_url(); }

 private:
  static LoopSettings settings(const std::string& database, QueueSettings queue,
                               NetworkLimits network, const ClientHandlerSettings& clients,
                               const AccessSettings& access,
                               const std::optional<WebSettings>& web) {
    LoopSettings settings;
    settings.web = web;
    settings.access = access;
    settings.service.clients = clients;
    settings.network = network;
    settings.queries.queue = queue;
    settings.database = database;
    settings.worker_port = "*";
    settings.client_port = "*";
    settings.service.solver_version = "1.0";
    // A long timeout, because simulated workers send no heartbeats and may be slow.
    settings.service.scheduler.lost_after_ms = kLongestSilence_ms;
    settings.queries.reader_program = OBLIQUE_SERVER_PROGRAM;
    return settings;
  }

  static constexpr std::int64_t kLongestSilence_ms =
      std::chrono::milliseconds(test::kHangLimit).count();

  int stop_fd_ = eventfd(0, 0);
  EventLoop loop_;
  LoopEnd end_{};
  std::thread thread_;
};

/// Sends messages of type `Out` and receives messages of type `In` on a DEALER socket.
template <typename Out, typename In>
class Peer {
 public:
  explicit Peer(const std::string& endpoint) : socket_(context_, zmq::socket_type::dealer) {
    socket_.set(zmq::sockopt::linger, 0);
    socket_.set(zmq::sockopt::rcvtimeo, kLongest_ms);
    disconnections_.init(socket_, "inproc://disconnections", ZMQ_EVENT_DISCONNECTED);
    socket_.connect(endpoint);
  }
  void send(const Out& message) { send_frame(protocol::encode(message)); }
  void send_frame(const std::string& frame) {
    socket_.send(zmq::buffer(frame), zmq::send_flags::none);
  }
  void send_frames(const std::vector<std::string>& frames) {
    for (std::size_t i = 0; i < frames.size(); ++i) {
      socket_.send(zmq::buffer(frames[i]),
                   i + 1 < frames.size() ? zmq::send_flags::sndmore : zmq::send_flags::none);
    }
  }
  /// Waits until the server ends the connection; returns false after a timeout.
  bool is_cut_off() { return disconnections_.check_event(kLongest_ms); }
  In receive() {
    zmq::message_t frame;
    In message;
    if (!socket_.recv(frame)) {
      throw std::runtime_error("the server does not answer");
    }
    if (!protocol::decode(frame.to_string_view(), message)) {
      throw std::runtime_error("the server sent an invalid message");
    }
    return message;
  }

 private:
  static constexpr int kLongest_ms = std::chrono::milliseconds(test::kHangLimit).count();

  zmq::context_t context_;
  zmq::socket_t socket_;
  zmq::monitor_t disconnections_;  // only disconnections
};

class SimulatedWorker : public Peer<WorkerMessage, ServerToWorker> {
 public:
  using Peer::Peer;

  ServerToWorker hello() {
    WorkerMessage message;
    protocol::set_protocol(*message.mutable_hello());
    message.mutable_hello()->set_solver_version("1.0");
    message.mutable_hello()->set_instruction_set("avx2");
    message.mutable_hello()->set_name("fake");
    message.mutable_hello()->set_threads(1);
    send(message);
    return receive();
  }
  ServerToWorker receive() {
    ServerToWorker message = Peer::receive();
    if (message.has_study()) {
      uids_[message.study().study_id()] = message.study().uid();
      studies_[message.study().study_id()] =
          std::make_unique<protocol::PointTable>(message.study().recipe());
    }
    return message;
  }
  void credit(std::uint32_t batches) {
    WorkerMessage message;
    message.mutable_credit()->set_batches(batches);
    send(message);
  }
  /// Makes `solve` report these points as failed.
  void fail(std::set<std::uint64_t> points) { failing_ = std::move(points); }
  /// Sends `results_of(batch)`. Returns the number of points.
  std::uint64_t solve(const protocol::Batch& batch) {
    send(results_of(batch));
    return points_of(batch).size();
  }
  /// Returns a message with a result for each point of the batch, or with the point as left out.
  WorkerMessage results_of(const protocol::Batch& batch) {
    WorkerMessage message;
    auto& results = *message.mutable_results();
    results.set_study_id(batch.study_id());
    results.set_study_uid(uids_.at(batch.study_id()));
    results.set_lease_id(batch.lease_id());
    results.set_attempt(batch.attempt());
    results.set_sequence(++sequence_);
    results.set_batch_done(true);
    results.set_busy_s(1e-3);
    const protocol::PointTable& table = *studies_.at(batch.study_id());
    for (const std::uint64_t point : points_of(batch)) {
      if (failing_.contains(point)) {
        *results.add_results() =
            protocol::failed_point(point, "failed as " + std::to_string(point));
      } else if (table.passes_filter(point)) {
        *results.add_results() = solved_point(point, table);
      } else {
        results.add_left_out(point);
        results.add_left_out(1);
      }
    }
    return message;
  }
  /// Solves batches, one at a time, until `points` points are acknowledged as stored.
  void work(std::uint64_t points) {
    std::uint64_t waiting = points;
    credit(1);
    while (waiting > 0) {
      const auto message = receive();
      if (message.has_batch()) {
        const std::uint64_t solved = solve(message.batch());
        in_hand_[sequence_] = solved;
      } else if (message.has_results_stored()) {
        waiting -= std::min(waiting, in_hand_.at(message.results_stored().sequence()));
        credit(1);
      }
    }
  }

 private:
  std::uint64_t sequence_ = 0;
  std::map<std::uint64_t, std::uint64_t> in_hand_;
  std::set<std::uint64_t> failing_;
  std::map<std::uint64_t, std::string> uids_;  // by study, as in the latest definitions
  // the latest definitions
  std::map<std::uint64_t, std::unique_ptr<protocol::PointTable>> studies_;
};

class SimulatedClient : public Peer<ClientRequest, ClientReply> {
 public:
  using Peer::Peer;

  ClientReply reply_to(ClientRequest request) {
    request.set_protocol_version(protocol::kProtocolVersion);
    request.set_request_id(++id_);
    send(request);
    const auto reply = receive();
    EXPECT_EQ(reply.request_id(), id_);
    return reply;
  }
  ClientReply submit(const std::string& name, std::uint64_t points) {
    return submit(name, table_of(points)->recipe());
  }
  ClientReply submit(const std::string& name, const protocol::Recipe& recipe) {
    ClientRequest request;
    request.mutable_submit()->set_name(name);
    *request.mutable_submit()->mutable_recipe() = recipe;
    return reply_to(request);
  }
  static ClientRequest query_request(const std::string& sql) {
    ClientRequest request;
    request.set_protocol_version(protocol::kProtocolVersion);
    request.mutable_query()->set_sql(sql);
    request.mutable_query()->set_time_limit_ms(kLongestTimeLimit_ms);
    return request;
  }
  ClientReply query(const std::string& sql) { return reply_to(query_request(sql)); }
  /// Runs a query and returns the rows of the first chunk.
  protocol::Table rows(const std::string& sql) {
    protocol::Table table;
    protocol::append_rows(query(sql).query(), table);
    return table;
  }
  /// Sends a query that takes minutes; returns when the server has started it.
  void start_query(const std::string& sql) {
    ClientRequest request = query_request(sql);
    request.set_request_id(++id_);
    send(request);
    constexpr int kMaxMessages = 600;  // one per second
    for (int words = 0; words < kMaxMessages; ++words) {
      const auto word = receive();
      ASSERT_TRUE(word.has_still_working());
      ASSERT_EQ(word.request_id(), id_);
      if (word.still_working().runs()) {
        return;
      }
    }
    FAIL() << "the query did not begin";
  }
  protocol::StudyStatus status(const std::string& name) {
    ClientRequest request;
    request.mutable_status()->set_study(name);
    return reply_to(request).status().studies(0);
  }

 private:
  std::uint64_t id_ = 0;
};

}  // namespace oblique::server
