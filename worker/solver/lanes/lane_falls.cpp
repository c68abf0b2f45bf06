#include "worker/solver/lanes/lane_falls.h"

#include <exception>
#include <new>
#include <optional>
#include <utility>

#include "worker/solver/motion/stepped_path.h"

namespace oblique::solver {
namespace {

class FallLanes {
 public:
  FallLanes(std::span<const SteppedFall> falls, const LaneKernel& kernel)
      : falls_(falls),
        solutions_(falls.size()),
        stepper_(falls.front().chain->tables(), kernel),
        lanes_(kernel.lanes),
        all_(kernel.lanes, 1),
        column_(falls.front().chain->at_rest()) {}

  std::vector<FallSolution> solve() {
    for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
      fill(lane);
    }
    while (busy_ > 0) {
      stepper_.step();
      for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
        if (lanes_[lane]) {
          look(lane);
        }
      }
      stepper_.settle(all_);
      for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
        after_step(lane);
      }
    }
    return std::move(solutions_);
  }

 private:
  struct Lane {
    std::size_t number;  ///< of the fall
    std::shared_ptr<SteppedPath> path;
    bool is_over = false;
  };

  /// The next fall that can begin, if there is one.
  void fill(std::size_t lane) {
    while (next_ < falls_.size()) {
      const std::size_t number = next_++;
      const SteppedFall& fall = falls_[number];
      try {
        lanes_[lane] =
            Lane{number, std::make_shared<SteppedPath>(fall.motion, fall.dt_s,
                                                       longest_fall_s(*fall.chain), fall.progress)};
      } catch (const std::bad_alloc&) {  // says nothing of this fall
        throw;
      } catch (const std::exception& error) {
        solutions_[number].error = error.what();
        continue;
      }
      const ChainState rest = fall.chain->at_rest();
      stepper_.load(lane, fall.chain->tables(), rest.q.data(), rest.v.data());
      stepper_.set_step(lane, fall.dt_s);
      stepper_.set_force(lane, {});
      ++busy_;
      return;
    }
  }

  /// At the end of a step, while the state before it can still be had.
  void look(std::size_t lane) {
    Lane& slot = *lanes_[lane];
    const auto tip = static_cast<std::size_t>(2 * falls_[slot.number].chain->tip_row());
    FallSolution& solution = solutions_[slot.number];
    try {
      if (slot.path->is_over_after_next(
              {stepper_.trial_q(lane, tip), stepper_.trial_q(lane, tip + 1),
               stepper_.trial_v(lane, tip), stepper_.trial_v(lane, tip + 1)})) {
        slot.path->end(stored(lane));
        solution.path = slot.path;
        slot.is_over = true;
      }
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception& error) {
      solution.error = error.what();
      slot.is_over = true;
    }
  }

  void after_step(std::size_t lane) {
    std::optional<Lane>& slot = lanes_[lane];
    if (!slot) {
      return;
    }
    if (!slot->is_over) {
      if (slot->path->keeps_last()) {
        slot->path->keep(stored(lane));
      }
      return;
    }
    slot.reset();
    --busy_;
    stepper_.idle(lane);
    fill(lane);
  }

  const ChainState& stored(std::size_t lane) {
    stepper_.store(lane, column_.q.data(), column_.v.data());
    return column_;
  }

  std::span<const SteppedFall> falls_;
  std::vector<FallSolution> solutions_;
  LaneStepper stepper_;
  std::vector<std::optional<Lane>> lanes_;
  std::vector<unsigned char> all_;  ///< every lane takes each step
  ChainState column_;
  std::size_t next_ = 0;
  std::size_t busy_ = 0;
};

}  // namespace

std::vector<FallSolution> solve_by_steps(std::span<const SteppedFall> falls,
                                         const LaneKernel& kernel) {
  return falls.empty() ? std::vector<FallSolution>{} : FallLanes(falls, kernel).solve();
}

}  // namespace oblique::solver
