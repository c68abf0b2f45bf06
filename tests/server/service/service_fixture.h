#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "proto/frames.h"
#include "proto/result_message.h"
#include "server/query/query_pool.h"
#include "server/service/service.h"
#include "tests/support/points.h"

namespace oblique::server {

using protocol::ClientReply;
using protocol::ClientRequest;
using protocol::ServerToWorker;
using protocol::WorkerMessage;

/// Records everything that the service sends. The tests choose the outcomes of writes, queries and
/// checks.
class FakePorts final : public Ports {
 public:
  Delivery to_worker(const std::string& identity, const std::string& frame) override {
    if (identity == unreachable) {
      return Delivery::kGone;
    }
    EXPECT_TRUE(protocol::decode(frame, worker_messages.emplace_back()));
    return identity == busy ? Delivery::kBusy : Delivery::kSent;
  }
  bool is_busy(const std::string& identity) const override { return identity == busy; }
  bool has_unread_input(const std::string& identity) const override {
    return identity == with_unread_input;
  }
  bool to_client(const std::string& identity, const std::string& frame) override {
    if (identity == unreachable) {
      return false;
    }
    EXPECT_TRUE(protocol::decode(frame, replies.emplace_back()));
    return true;
  }
  void write(WriteJob job) override { jobs.push_back(std::move(job)); }
  bool query(QueryJob job) override {
    queries.push_back(std::move(job));
    return queries.size() < 3;
  }
  void more_rows(std::uint64_t ticket, std::uint64_t taken) override {
    more.emplace_back(ticket, taken);
  }
  void cancel_query(std::uint64_t ticket) override { cancelled_queries.push_back(ticket); }
  void run_check(Check check) override { checks.push_back(std::move(check)); }
  void log(Severity, const std::string& text) override { lines.push_back(text); }

  std::string unreachable;
  std::string busy;
  std::string with_unread_input;
  std::vector<ServerToWorker> worker_messages;
  std::vector<ClientReply> replies;
  std::vector<WriteJob> jobs;
  std::vector<QueryJob> queries;
  std::vector<std::uint64_t> cancelled_queries;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> more;  // ticket, received chunks
  std::vector<Check> checks;
  std::vector<std::string> lines;  // lines of the log
};

inline ClientRequest client_request(std::uint64_t request_id = 0) {
  ClientRequest message;
  message.set_protocol_version(protocol::kProtocolVersion);
  message.set_request_id(request_id);
  return message;
}

/// Returns a submission with a recipe of at least `bytes` bytes.
inline ClientRequest long_submission(const std::string& name, std::size_t bytes) {
  ClientRequest message = client_request(7);
  message.mutable_submit()->set_name(name);
  auto& mu = *message.mutable_submit()->mutable_recipe();
  mu = protocol::recipe_of(
      {{protocol::listed("H", {1.0}), protocol::listed("mu", {}), protocol::listed("e", {1.0})}});
  for (std::size_t i = 0; i < bytes / 8 + 1; ++i) {
    mu.mutable_blocks(0)->mutable_axes(1)->add_values(0.1 + 1e-9 * static_cast<double>(i));
  }
  return message;
}

/// A request of this size is parsed on the check thread.
inline constexpr std::size_t kLongRequest = std::size_t{100} * 1024;

class ServiceTest : public testing::Test {
 protected:
  ServiceTest() { start({}); }

  /// Replaces the service by one with these settings and stored studies.
  void start(ServiceSettings settings, std::vector<StoredStudy> studies = {}) {
    settings.solver_version = "1.0";
    settings.database_id = "db";
    service_.emplace(settings, ports_, std::move(studies), now_);
  }

  void request(const ClientRequest& message,
               const std::shared_ptr<const KeyIdentity>& holder = nullptr) {
    service_->client_frame("client", protocol::encode(message), now_, holder);
    check_invariants();
  }
  /// Sends a message on the connection `identity`.
  void send(const ClientRequest& message, const std::string& identity,
            const std::shared_ptr<const KeyIdentity>& holder = nullptr) {
    service_->client_frame(identity, protocol::encode(message), now_, holder);
  }
  void end(std::uint64_t request_id, const std::string& identity = "client") {
    ClientRequest message = client_request(request_id);
    message.mutable_end_query()->set_request_id(request_id);
    send(message, identity);
  }
  std::string last_error() { return last_reply().error().message(); }
  /// Returns a submission that does not reuse results.
  ClientRequest submit_request(const std::string& name, std::uint64_t points = 10) {
    ClientRequest message = client_request(42);
    message.mutable_submit()->set_name(name);
    *message.mutable_submit()->mutable_recipe() = table_of(points)->recipe();
    message.mutable_submit()->set_no_reuse(true);
    return message;
  }
  /// Submits a study and completes its write.
  void submit(const std::string& name, std::uint64_t points = 10) {
    submit(name, table_of(points)->recipe());
  }
  void submit(const std::string& name, const protocol::Recipe& recipe) {
    ClientRequest message = submit_request(name);
    *message.mutable_submit()->mutable_recipe() = recipe;
    request(message);
    write_all();
  }
  ClientRequest change_request(const std::string& name, protocol::StudyChange change) {
    ClientRequest message = client_request();
    message.mutable_change()->set_study(name);
    message.mutable_change()->set_change(change);
    return message;
  }
  ClientRequest cancel_request(const std::string& name) {
    return change_request(name, protocol::STUDY_CHANGE_CANCEL);
  }
  /// Requests a change and completes its write.
  void change(const std::string& name, protocol::StudyChange change) {
    request(change_request(name, change));
    write_all();
  }
  /// Answers the last batch and completes the write. The points from `first_failed` on are answered
  /// as failed.
  void answer_batch(std::uint64_t first_failed, const std::string& identity = "worker") {
    const auto batch = last_message().batch();
    WorkerMessage message;
    auto& results = *message.mutable_results();
    results.set_study_id(batch.study_id());
    results.set_study_uid(uid_of(batch.study_id()));
    results.set_lease_id(batch.lease_id());
    results.set_attempt(batch.attempt());
    results.set_sequence(++sequence_);
    results.set_batch_done(true);
    for (const std::uint64_t i : points_of(batch)) {
      if (!service_->states().record(batch.study_id()).table->passes_filter(i)) {
        results.add_left_out(i);
        results.add_left_out(1);
        continue;
      }
      *results.add_results() = i >= first_failed ? protocol::failed_point(i, "for the test")
                                                 : solved(i, batch.study_id());
    }
    worker_sends(message, identity);
    write_all();
  }
  std::string uid_of(StudyId study) const {
    return service_->states().contains(study) ? service_->states().record(study).uid : "";
  }
  /// Returns a worker's result for a point.
  protocol::PointResult solved(std::uint64_t point, StudyId study = 1) const {
    return solved_point(point, *service_->states().record(study).table.get());
  }
  /// Returns a message with results for these points.
  WorkerMessage results_of(const std::vector<std::uint64_t>& points, StudyId study = 1,
                           std::uint64_t lease = 0) {
    WorkerMessage message;
    auto& results = *message.mutable_results();
    results.set_study_id(study);
    results.set_study_uid(uid_of(study));
    results.set_lease_id(lease);
    results.set_sequence(++sequence_);
    for (const std::uint64_t point : points) {
      *results.add_results() = solved(point, study);
    }
    return message;
  }
  void worker_sends(const WorkerMessage& message, const std::string& identity = "worker") {
    service_->worker_frame(identity, protocol::encode(message), now_);
    check_invariants();
  }
  /// Lets a worker join and request a batch.
  void hello_and_credit() {
    hello();
    credit(1);
  }
  void hello(const std::string& identity = "worker", const std::string& solver = "1.0") {
    WorkerMessage message;
    protocol::set_protocol(*message.mutable_hello());
    message.mutable_hello()->set_solver_version(solver);
    message.mutable_hello()->set_threads(1);
    worker_sends(message, identity);
  }
  void credit(std::uint32_t batches, const std::string& identity = "worker") {
    WorkerMessage message;
    message.mutable_credit()->set_batches(batches);
    worker_sends(message, identity);
  }
  protocol::StatusReply statuses(std::uint64_t after = 0, std::uint32_t limit = 0) {
    ClientRequest message = client_request();
    message.mutable_status()->set_after_study_id(after);
    message.mutable_status()->set_limit(limit);
    service_->client_frame("client", protocol::encode(message), now_);
    return last_reply().status();
  }
  protocol::WorkersReply workers(std::uint64_t after = 0) {
    ClientRequest message = client_request();
    message.mutable_workers()->set_after_worker_id(after);
    service_->client_frame("client", protocol::encode(message), now_);
    return last_reply().workers();
  }
  protocol::StudyStatus status_of(const std::string& name) {
    ClientRequest message = client_request();
    message.mutable_status()->set_study(name);
    request(message);
    return last_reply().status().studies(0);
  }
  /// Completes all waiting writes. If `error` is not empty, writes that can fail end with that
  /// error.
  void write_all(const std::string& error = {}) {
    for (const WriteJob& job : std::exchange(ports_.jobs, {})) {
      const bool refused = !error.empty() && job.answer_failure;
      service_->written(
          {refused ? WriteReport::Kind::kRefused : WriteReport::Kind::kStored, job.ticket, error},
          now_);
    }
    check_invariants();
  }
  void check_invariants() const {
    service_->scheduler().check_invariants();
    std::uint64_t open = 0;
    for (const StudyId id : service_->states().unfinished()) {
      open += service_->states().record(id).table.size();
    }
    EXPECT_EQ(service_->states().open_points(), open);
  }
  /// Ends the `index`-th query with the given reply.
  void answer_query(std::size_t index, const std::string& reply) {
    service_->query_report({QueryReport::Kind::kAnswered, ports_.queries.at(index).ticket, reply});
  }
  /// Runs the waiting checks.
  void run_checks() {
    for (const Ports::Check& check : std::exchange(ports_.checks, {})) {
      check()(now_);
    }
    check_invariants();
  }
  /// Advances the clock in steps of 100 ms, with a tick of the service after each.
  void pass(std::int64_t duration_ms) {
    for (const std::int64_t end_ms = now_.steady_ms + duration_ms; now_.steady_ms < end_ms;) {
      now_.steady_ms += 100;
      service_->tick(now_);
    }
  }
  ClientReply last_reply() {
    EXPECT_FALSE(ports_.replies.empty());
    return ports_.replies.empty() ? ClientReply() : ports_.replies.back();
  }
  ServerToWorker last_message() {
    EXPECT_FALSE(ports_.worker_messages.empty());
    return ports_.worker_messages.empty() ? ServerToWorker() : ports_.worker_messages.back();
  }

  std::uint64_t sequence_ = 0;
  Instant now_{1000, 1'700'000'000'123};
  FakePorts ports_;
  std::optional<Service> service_;
};

}  // namespace oblique::server
