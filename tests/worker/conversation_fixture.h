#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "proto/recipe/model_message.h"
#include "proto/result_message.h"
#include "worker/conversation.h"

namespace oblique::worker {

/// Returns a recipe with `points` points of one model.
inline protocol::Recipe recipe_with_points(std::uint64_t points) {
  protocol::Recipe recipe;
  *recipe.mutable_model() = protocol::to_message(solver::preset("paper"));
  protocol::Block& block = *recipe.add_blocks();
  const auto add = [&](const std::string& key, double value) {
    protocol::Axis& axis = *block.add_axes();
    axis.set_key(key);
    axis.add_values(value);
  };
  add("H", 1.0);
  add("mu", 0.4);
  protocol::Axis& e = *block.add_axes();
  e.set_key("e");
  e.set_from(0.5);
  e.set_to(1.0);
  e.set_count(points);
  return recipe;
}

inline protocol::ServerToWorker welcome_message(const std::string& database_id = "db") {
  protocol::ServerToWorker message;
  message.mutable_welcome()->set_worker_id(1);
  message.mutable_welcome()->set_heartbeat_interval_ms(1000);
  message.mutable_welcome()->set_lost_after_ms(3000);
  message.mutable_welcome()->set_database_id(database_id);
  return message;
}

inline protocol::ServerToWorker study_message(std::uint64_t study_id, std::uint64_t points = 100) {
  protocol::ServerToWorker message;
  message.mutable_study()->set_study_id(study_id);
  *message.mutable_study()->mutable_recipe() = recipe_with_points(points);
  return message;
}

inline protocol::ServerToWorker batch_message(std::uint64_t study_id, std::uint64_t lease_id,
                                              std::uint64_t first_point = 0,
                                              std::uint64_t count = 10) {
  protocol::ServerToWorker message;
  protocol::Batch& batch = *message.mutable_batch();
  batch.set_study_id(study_id);
  batch.set_lease_id(lease_id);
  batch.add_ranges(static_cast<std::int64_t>(first_point));
  batch.add_ranges(static_cast<std::int64_t>(count));
  batch.set_attempt(1);
  return message;
}

inline protocol::ServerToWorker stored_message(std::uint64_t sequence) {
  protocol::ServerToWorker message;
  message.mutable_results_stored()->set_sequence(sequence);
  return message;
}

inline protocol::ServerToWorker withdraw_message(std::uint64_t study_id) {
  protocol::ServerToWorker message;
  message.mutable_withdraw()->set_study_id(study_id);
  return message;
}

inline protocol::ServerToWorker hello_again_message() {
  protocol::ServerToWorker message;
  message.mutable_hello_again();
  return message;
}

inline protocol::ServerToWorker heartbeat_reply_message() {
  protocol::ServerToWorker message;
  message.mutable_heartbeat_reply();
  return message;
}

/// A worker's conversation whose time and messages come from the test. Keeps the effects of the
/// last event.
class ConversationTest : public ::testing::Test {
 protected:
  void start() { take(conversation_->start(now_ms_)); }

  void receive(const protocol::ServerToWorker& message) {
    take(conversation_->on_message(message, now_ms_));
  }

  /// Starts the conversation and receives a welcome and study 7, which has 100 points.
  void join() {
    start();
    receive(welcome_message());
    receive(study_message(7));
  }

  /// Like `join`, but with these settings. Also receives lease 31 of points 0 to 9.
  void join_with_batch(const ConversationSettings& settings = {}) {
    use(settings);
    join();
    receive(batch_message(7, 31));
  }

  /// Lets the server request a new hello and welcome the worker again.
  void rejoin(const std::string& database_id = "db") {
    receive(hello_again_message());
    receive(welcome_message(database_id));
  }

  void stop() { take(conversation_->stop(now_ms_)); }

  void pass(std::int64_t duration_ms) {
    now_ms_ += duration_ms;
    take(conversation_->on_time(now_ms_));
  }

  /// Reports points `first` to `first + count − 1` of a batch as solved.
  void solve(std::uint64_t batch, std::uint64_t first, std::uint64_t count, bool batch_done,
             std::uint64_t study_id = 7) {
    Progress progress{batch,      study_id, {}, 0.5,
                      batch_done, {},       1,  "uid " + std::to_string(study_id)};
    for (std::uint64_t i = 0; i < count; ++i) {
      progress.results.push_back(protocol::failed_point(first + i, "for the test"));
    }
    std::vector<Progress> all;
    all.push_back(std::move(progress));
    take(conversation_->on_progress(std::move(all), now_ms_));
  }

  template <class Kind>
  std::vector<Kind> effects_of() const {
    std::vector<Kind> found;
    for (const Effect& effect : effects_) {
      if (const Kind* kind = std::get_if<Kind>(&effect)) {
        found.push_back(*kind);
      }
    }
    return found;
  }

  template <class Kind>
  bool has() const {
    return !effects_of<Kind>().empty();
  }

  /// Returns the messages of one kind among the last effects.
  std::vector<protocol::WorkerMessage> sent(protocol::WorkerMessage::KindCase kind) const {
    std::vector<protocol::WorkerMessage> found;
    for (const Send& send : effects_of<Send>()) {
      if (send.message.kind_case() == kind) {
        found.push_back(send.message);
      }
    }
    return found;
  }

  std::vector<protocol::Results> sent_results() const {
    std::vector<protocol::Results> found;
    for (const auto& message : sent(protocol::WorkerMessage::kResults)) {
      found.push_back(message.results());
    }
    return found;
  }

  /// Returns the number of batches that the last effects request.
  std::uint32_t credit_given() const {
    std::uint32_t batches = 0;
    for (const auto& message : sent(protocol::WorkerMessage::kCredit)) {
      batches += message.credit().batches();
    }
    return batches;
  }

  /// Returns the worker's exit code; nothing before the conversation has ended.
  std::optional<int> exit_code() const {
    return finish() ? std::optional(finish()->exit_code) : std::nullopt;
  }

  std::optional<Finish> finish() const {
    const auto all = effects_of<Finish>();
    return all.empty() ? std::nullopt : std::optional(all.front());
  }

  /// Replaces the conversation by one with these settings.
  void use(const ConversationSettings& settings) { conversation_.emplace(hello(), settings); }

  static protocol::WorkerHello hello() {
    protocol::WorkerHello hello;
    hello.set_protocol_version(1);
    hello.set_name("test");
    return hello;
  }

  void take(Effects effects) { effects_ = std::move(effects); }

  std::int64_t now_ms_ = 1'000'000;
  std::optional<Conversation> conversation_{std::in_place, hello(), ConversationSettings{}};
  Effects effects_;
};

}  // namespace oblique::worker
