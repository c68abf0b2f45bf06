#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "proto/frames.h"
#include "proto/recipe/point_table.h"
#include "proto/result_message.h"
#include "tests/simulation/network.h"
#include "tests/simulation/world.h"
#include "worker/conversation.h"

namespace oblique::simulation {

constexpr double kMarkInH = 0x1p-20;

inline std::uint64_t mark_of(double H) {
  return static_cast<std::uint64_t>((H - 1.0) / kMarkInH);
}

/// H of all points of the study with that mark.
inline double marked_H(std::uint64_t mark) {
  return 1.0 + static_cast<double>(mark) * kMarkInH;
}

/// The made-up answer to a point; whoever checks it knows that it is of this study, by its mark,
/// and point.
inline protocol::PointResult answer_to(std::uint64_t mark, std::uint64_t point) {
  solver::CaseResult result{};
  result.duration_s = static_cast<double>(mark);
  result.fn_peak_N = static_cast<double>(point);
  return protocol::to_message(point, result);
}

/// The real conversation of a worker around a pretended solver. It can be killed, stopped for a
/// while, or told to end; it always starts again.
class SimulatedWorker {
 public:
  /// `peer` is its number in the network. A model's first point takes some of them longer than the
  /// others. One that `leaves` has now and then a time by which it
  /// is gone; another one comes then.
  SimulatedWorker(World& world, Network& network, std::uint64_t peer, bool leaves)
      : world_(world),
        network_(network),
        peer_(peer),
        leaves_(leaves),
        ms_per_point_(world.chance(0.2) ? world.between(50, 400) : world.between(1, 20)),
        ms_per_fall_(world.chance(0.3) ? world.between(5, 50) : 0) {}

  /// The process, if there is one, dies; another one starts after a while. The first one starts so
  /// too.
  void restart(std::int64_t away_ms) {
    ++life_;
    ++sockets_;
    network_.close(link_, world_.chance(0.5));
    link_ = 0;
    batches_.clear();
    solving_ = false;
    fallen_model_ = {};
    frozen_until_ms_ = 0;
    conversation_.reset();
    sent_.clear();
    world_.after(away_ms, [this, life = life_] {
      if (life == life_) {
        start();
      }
    });
  }
  /// The process stands still for a while, as after SIGSTOP.
  void freeze(std::int64_t duration_ms) { frozen_until_ms_ = world_.now_ms() + duration_ms; }
  void stop() {
    if (conversation_) {
      apply(conversation_->stop(world_.now_ms()));
    }
  }

  /// The results of that message of the socket, or nullptr.
  const protocol::Results* sent(Network::LinkId link, std::uint64_t sequence) const {
    const auto found = sent_.find({link, sequence});
    return found == sent_.end() ? nullptr : &found->second;
  }
  bool holds_nothing() const { return batches_.empty(); }

 private:
  struct Work {
    worker::Batch batch;
    std::uint64_t solved;  ///< positions
  };
  void start() {
    protocol::WorkerHello hello;
    protocol::say_protocol(hello);
    hello.set_solver_version("1");
    hello.set_threads(1);
    ++life_;
    hello.set_process_id(std::to_string(peer_) + " in life " + std::to_string(life_));
    planned_time_ms_ = -1;
    worker::ConversationSettings settings;
    if (leaves_ && world_.chance(0.2)) {
      settings.exit.until_ms = world_.now_ms() + world_.between(3000, 60'000);
    }
    conversation_.emplace(hello, settings);
    apply(conversation_->start(world_.now_ms()));
  }
  /// Runs `what` of this process life now, or when it is no longer frozen.
  void when_awake(std::function<void()> what) {
    if (world_.now_ms() >= frozen_until_ms_) {
      what();
      return;
    }
    world_.after(frozen_until_ms_ - world_.now_ms(), [this, life = life_, what = std::move(what)] {
      if (life == life_) {
        when_awake(what);
      }
    });
  }
  void apply(worker::Effects effects) {
    for (worker::Effect& effect : effects) {
      if (std::holds_alternative<worker::Connect>(effect)) {
        network_.close(link_, true);
        const std::uint64_t socket = ++sockets_;
        link_ = network_.open(peer_, [this, socket](const std::string& frame) {
          when_awake([this, socket, frame] {
            protocol::ServerToWorker message;
            if (socket == sockets_ && protocol::decode(frame, message)) {
              apply(conversation_->on_message(message, world_.now_ms()));
            }
          });
        });
      } else if (auto* send = std::get_if<worker::Send>(&effect)) {
        const bool is_results = send->message.has_results();
        if (is_results) {
          sent_[{link_, send->message.results().sequence()}] = send->message.results();
        }
        network_.send(link_, protocol::encode(send->message),
                      is_results || send->message.has_heartbeat());
      } else if (auto* solve = std::get_if<worker::Solve>(&effect)) {
        batches_.push_back({std::move(solve->batch), 0});
      } else if (const auto* drop = std::get_if<worker::DropStudy>(&effect)) {
        std::erase_if(batches_,
                      [&](const Work& w) { return w.batch.study_id() == drop->study_id; });
      } else if (const auto* batch = std::get_if<worker::DropBatch>(&effect)) {
        std::erase_if(batches_, [&](const Work& w) { return w.batch.number() == batch->number; });
      } else if (std::holds_alternative<worker::DropAll>(effect)) {
        batches_.clear();
      } else if (std::holds_alternative<worker::Finish>(effect)) {
        restart(world_.between(10, 2000));
        return;
      }
    }
    plan_time();
    plan_solving();
  }
  void plan_time() {
    const std::int64_t due_ms = conversation_->next_deadline_ms();
    if (planned_time_ms_ >= world_.now_ms() && planned_time_ms_ <= due_ms) {
      return;
    }
    planned_time_ms_ = due_ms;
    world_.after(std::max<std::int64_t>(due_ms - world_.now_ms(), 0), [this, life = life_, due_ms] {
      if (life != life_ || due_ms != planned_time_ms_) {
        return;
      }
      when_awake([this, life] {
        if (life == life_) {
          planned_time_ms_ = -1;
          apply(conversation_->on_time(world_.now_ms()));
        }
      });
    });
  }
  void plan_solving() {
    if (solving_ || batches_.empty() || !conversation_->may_solve()) {
      return;
    }
    solving_ = true;
    busy_ms_ = ms_per_point_ + (next_model() == fallen_model_ ? 0 : ms_per_fall_);
    world_.after(busy_ms_, [this, life = life_] {
      if (life == life_) {
        when_awake([this, life] {
          if (life == life_) {
            solving_ = false;
            solve_some();
          }
        });
      }
    });
  }
  void solve_some() {
    if (batches_.empty()) {
      return;
    }
    Work& work = batches_.front();
    const std::uint64_t position = next_position(work);
    worker::Progress progress{work.batch.number(),
                              work.batch.study_id(),
                              {},
                              1e-3 * static_cast<double>(busy_ms_),
                              false,
                              {}};
    work.batch.append_points(work.solved, position, progress.left_out);
    if (position < work.batch.size()) {
      const std::uint64_t point = work.batch.point_at(position);
      const std::uint64_t mark = mark_of(work.batch.points().point(point).H_m);
      fallen_model_ = next_model();
      work.solved = position + 1;
      progress.results.push_back(answer_to(mark, point));
      protocol::set_inputs(progress.results.back(), work.batch.points());
    }
    progress.batch_done = next_position(work) == work.batch.size();
    if (progress.batch_done) {
      work.batch.append_points(std::max(work.solved, position), work.batch.size(),
                               progress.left_out);
    }
    if (progress.batch_done) {
      batches_.pop_front();
    }
    std::vector<worker::Progress> all;
    all.push_back(std::move(progress));
    apply(conversation_->on_progress(std::move(all), world_.now_ms()));
  }
  /// The position of the next point that the study's filter leaves in, or the end of the batch.
  static std::uint64_t next_position(const Work& work) {
    return work.batch.first_to_solve(work.solved, work.batch.size());
  }
  std::pair<std::uint64_t, std::uint64_t> next_model() const {
    const Work& work = batches_.front();
    const std::uint64_t position = next_position(work);
    if (position == work.batch.size()) {
      return fallen_model_;
    }
    const std::uint64_t point = work.batch.point_at(position);
    return {work.batch.study_id(), work.batch.points().point(point).model};
  }

  World& world_;
  Network& network_;
  std::uint64_t peer_;
  bool leaves_;
  std::int64_t ms_per_point_;
  std::int64_t ms_per_fall_;
  std::int64_t busy_ms_ = 0;                                // with the next point
  std::pair<std::uint64_t, std::uint64_t> fallen_model_{};  // study and model solved last
  std::optional<worker::Conversation> conversation_;
  Network::LinkId link_ = 0;
  std::deque<Work> batches_;
  bool solving_ = false;
  std::int64_t frozen_until_ms_ = 0;
  std::int64_t planned_time_ms_ = -1;
  std::uint64_t life_ = 0;     // counts processes: what an earlier one planned does not happen
  std::uint64_t sockets_ = 0;  // counts sockets: what waits in an earlier one is gone
  std::map<std::pair<Network::LinkId, std::uint64_t>, protocol::Results> sent_;
};

}  // namespace oblique::simulation
