#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "tests/simulation/network.h"
#include "tests/simulation/world.h"
#include "worker/conversation.h"

namespace oblique::simulation {

/// The made-up answer to a point; whoever checks it knows that it is of this study, by its mark,
/// and point.
protocol::PointResult answer_to(std::uint64_t mark, std::uint64_t point);

/// H of all points of the study with that mark.
double marked_H(std::uint64_t mark);

/// The real conversation of a worker around a pretended solver. It can be killed, stopped for a
/// while, or told to end; it always starts again.
class SimulatedWorker {
 public:
  /// `peer` is its number in the network. A model's first point takes some of them longer than the
  /// others. One that `leaves` has now and then a time by which it
  /// is gone; another one comes then.
  SimulatedWorker(World& world, Network& network, std::uint64_t peer, bool leaves);

  /// The process, if there is one, dies; another one starts after a while. The first one starts so
  /// too.
  void restart(std::int64_t away_ms);
  /// The process stands still for a while, as after SIGSTOP.
  void freeze(std::int64_t duration_ms) { frozen_until_ms_ = world_.now_ms() + duration_ms; }
  void stop();

  /// The results of that message of the socket, or nullptr.
  const protocol::Results* sent(Network::LinkId link, std::uint64_t sequence) const;
  bool holds_nothing() const { return batches_.empty(); }

 private:
  struct Work {
    worker::Batch batch;
    std::uint64_t solved;  ///< positions
  };
  void start();
  /// Runs `what` of this process life now, or when it is no longer frozen.
  void when_awake(std::function<void()> what);
  void apply(worker::Effects effects);
  void plan_time();
  void plan_solving();
  void solve_some();
  static std::uint64_t next_position(const Work& work);
  std::pair<std::uint64_t, std::uint64_t> next_model() const;

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
