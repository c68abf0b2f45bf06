#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "proto/frames.h"
#include "proto/result_message.h"
#include "server/query/reader_program.h"
#include "server/service/service.h"
#include "tests/support/points.h"

namespace oblique::server {

using protocol::ClientReply;
using protocol::ClientRequest;
using protocol::ServerToWorker;
using protocol::WorkerMessage;

/// Keeps what the service sends, and writes only when told to.
class FakeOutbox final : public Outbox {
 public:
  Delivery to_worker(const std::string& identity, const ServerToWorker& message) override {
    if (identity == unreachable) {
      return Delivery::kGone;
    }
    worker_messages.push_back(message);
    return identity == busy ? Delivery::kBusy : Delivery::kSent;
  }
  Delivery forward_to_worker(const std::string& identity, const std::string& frame) override {
    ServerToWorker message;
    EXPECT_TRUE(protocol::decode(frame, message));
    return to_worker(identity, message);
  }
  bool is_busy(const std::string& identity) const override { return identity == busy; }
  bool has_unheard(const std::string& identity) const override { return identity == unheard; }
  bool to_client(const std::string& identity, const ClientReply& reply) override {
    if (identity == unreachable) {
      return false;
    }
    replies.push_back(reply);
    return true;
  }
  bool forward_to_client(const std::string& identity, const std::string& frame) override {
    ClientReply reply;
    EXPECT_TRUE(protocol::decode(frame, reply));
    return to_client(identity, reply);
  }
  void write(WriteJob job) override { jobs.push_back(std::move(job)); }
  bool query(QueryJob job) override {
    queries.push_back(std::move(job));
    return queries.size() < 3;
  }
  void more_rows(std::uint64_t ticket, std::uint64_t taken) override {
    wishes.emplace_back(ticket, taken);
  }
  void cancel_query(std::uint64_t ticket) override { cancelled_queries.push_back(ticket); }
  void read(ReadJob job) override { reads.push_back(std::move(job)); }
  void note(Severity, const std::string& text) override {
    ++notes;
    log.push_back(text);
  }

  std::string unreachable;
  std::string busy;
  std::string unheard;
  std::vector<ServerToWorker> worker_messages;
  std::vector<ClientReply> replies;
  std::vector<WriteJob> jobs;
  std::vector<QueryJob> queries;
  std::vector<std::uint64_t> cancelled_queries;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> wishes;  // ticket, chunks taken
  std::vector<ReadJob> reads;
  int notes = 0;
  std::vector<std::string> log;
};

class ServiceTest : public testing::Test {
 protected:
  ServiceTest() {
    ServiceSettings settings;
    settings.solver_version = "1.0";
    settings.database_id = "db";
    service_.emplace(settings, outbox_, std::vector<StoredStudy>{}, now_);
  }

  void request(const ClientRequest& message,
               const std::shared_ptr<const KeyHolder>& holder = nullptr) {
    service_->client_frame("client", protocol::encode(message), now_, holder);
    service_->scheduler().check_invariants();
  }
  /// Results of other studies are not reused.
  ClientRequest submit_request(const std::string& name, std::uint64_t points = 10) {
    ClientRequest message;
    message.set_protocol_version(protocol::kProtocolVersion);
    message.set_request_id(42);
    message.mutable_submit()->set_name(name);
    *message.mutable_submit()->mutable_recipe() = table_of(points)->recipe();
    message.mutable_submit()->set_no_reuse(true);
    return message;
  }
  ClientRequest change_request(const std::string& name, protocol::StudyChange change) {
    ClientRequest message;
    message.set_protocol_version(protocol::kProtocolVersion);
    message.mutable_change()->set_study(name);
    message.mutable_change()->set_change(change);
    return message;
  }
  ClientRequest cancel_request(const std::string& name) {
    return change_request(name, protocol::STUDY_CHANGE_CANCEL);
  }
  /// Results of the points of the last batch, failed ones from `first_failed` on.
  void answer_batch(std::uint64_t first_failed, const std::string& identity = "worker") {
    const auto batch = last_message().batch();
    WorkerMessage message;
    auto& results = *message.mutable_results();
    results.set_study_id(batch.study_id());
    results.set_lease_id(batch.lease_id());
    results.set_attempt(batch.attempt());
    results.set_sequence(++sequence_);
    results.set_batch_done(true);
    for (const std::uint64_t i : points_of(batch)) {
      if (batch.study_id() != 0 &&
          !service_->states().record(batch.study_id()).table->is_left_in(i)) {
        results.add_left_out(i);
        results.add_left_out(1);
        continue;
      }
      *results.add_results() = i >= first_failed       ? protocol::failed_point(i, "for the test")
                               : batch.study_id() == 0 ? solved_point(i)  // of a probe
                                                       : solved(i, batch.study_id());
    }
    worker_says(message, identity);
    write_all();
  }
  /// The point of that study as a worker sends it.
  protocol::PointResult solved(std::uint64_t point, StudyId study = 1) const {
    return solved_point(point, *service_->states().record(study).table.get());
  }
  void worker_says(const WorkerMessage& message, const std::string& identity = "worker") {
    service_->worker_frame(identity, protocol::encode(message), now_);
    service_->scheduler().check_invariants();
  }
  void hello(const std::string& identity = "worker", const std::string& solver = "1.0") {
    WorkerMessage message;
    protocol::say_protocol(*message.mutable_hello());
    message.mutable_hello()->set_solver_version(solver);
    message.mutable_hello()->set_threads(1);
    worker_says(message, identity);
  }
  void credit(std::uint32_t batches, const std::string& identity = "worker") {
    WorkerMessage message;
    message.mutable_credit()->set_batches(batches);
    worker_says(message, identity);
  }
  protocol::StudyStatus status_of(const std::string& name) {
    ClientRequest message;
    message.set_protocol_version(protocol::kProtocolVersion);
    message.mutable_status()->set_study(name);
    request(message);
    return last_reply().status().studies(0);
  }
  /// All that waits is written, and fails with `error` unless that is empty.
  void write_all(const std::string& error = {}) {
    for (const WriteJob& job : std::exchange(outbox_.jobs, {})) {
      const bool refused = !error.empty() && job.answer_failure;
      service_->written(
          {refused ? WriteReport::Kind::kRefused : WriteReport::Kind::kStored, job.ticket, error},
          now_);
    }
    service_->scheduler().check_invariants();
  }
  /// The query that was asked `index`-th gets that answer.
  void answer_query(std::size_t index, const std::string& reply) {
    service_->queried({QueryReport::Kind::kAnswered, outbox_.queries.at(index).ticket, reply});
  }
  /// Long requests that wait are read.
  void read_all() {
    for (const ReadJob& job : std::exchange(outbox_.reads, {})) {
      service_->request_read({job.ticket, read_request(job.frame)}, now_);
    }
    service_->scheduler().check_invariants();
  }
  ClientReply last_reply() {
    EXPECT_FALSE(outbox_.replies.empty());
    return outbox_.replies.empty() ? ClientReply() : outbox_.replies.back();
  }
  ServerToWorker last_message() {
    EXPECT_FALSE(outbox_.worker_messages.empty());
    return outbox_.worker_messages.empty() ? ServerToWorker() : outbox_.worker_messages.back();
  }

  std::uint64_t sequence_ = 0;
  Instant now_{1000, 1'700'000'000'123};
  FakeOutbox outbox_;
  std::optional<Service> service_;
};

}  // namespace oblique::server
