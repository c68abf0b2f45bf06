#include "worker/solver/fast/lane_falls.h"

#include <exception>
#include <new>
#include <optional>
#include <utility>

#include "worker/solver/fast/lane_stepper.h"

namespace oblique::solver {
namespace {

class FallLanes {
 public:
  FallLanes(std::span<const FallRequest> requests, const LaneKernel& kernel)
      : requests_(requests),
        solutions_(requests.size()),
        stepper_(requests.front().chain->tables(), kernel),
        lanes_(kernel.lanes),
        all_(kernel.lanes, 1),
        column_(requests.front().chain->at_rest()) {}

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
    std::shared_ptr<SteppedFall> fall;
    bool is_over = false;
  };

  /// The next fall that can begin, if there is one.
  void fill(std::size_t lane) {
    while (next_ < requests_.size()) {
      const std::size_t number = next_++;
      const FallRequest& request = requests_[number];
      try {
        lanes_[lane] = Lane{number, std::make_shared<SteppedFall>(request.motion, request.dt_s,
                                                                  longest_fall_s(*request.chain),
                                                                  request.progress)};
      } catch (const std::bad_alloc&) {  // says nothing of this fall
        throw;
      } catch (const std::exception& error) {
        solutions_[number].error = error.what();
        continue;
      }
      const ChainState rest = request.chain->at_rest();
      stepper_.load(lane, request.chain->tables(), rest.q.data(), rest.v.data());
      stepper_.set_step(lane, request.dt_s);
      stepper_.set_force(lane, {});
      ++busy_;
      return;
    }
  }

  /// At the end of a step, while the state before it can still be had.
  void look(std::size_t lane) {
    Lane& slot = *lanes_[lane];
    const auto tip = static_cast<std::size_t>(2 * requests_[slot.number].chain->tip_row());
    FallSolution& solution = solutions_[slot.number];
    try {
      if (slot.fall->is_over_after_next(
              {stepper_.trial_q(lane, tip), stepper_.trial_q(lane, tip + 1),
               stepper_.trial_v(lane, tip), stepper_.trial_v(lane, tip + 1)})) {
        slot.fall->end(stored(lane));
        solution.fall = slot.fall;
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
      if (slot->fall->keeps_last()) {
        slot->fall->keep(stored(lane));
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

  std::span<const FallRequest> requests_;
  std::vector<FallSolution> solutions_;
  LaneStepper stepper_;
  std::vector<std::optional<Lane>> lanes_;
  std::vector<unsigned char> all_;  ///< every lane takes each step
  ChainState column_;
  std::size_t next_ = 0;
  std::size_t busy_ = 0;
};

}  // namespace

std::vector<FallSolution> solve_by_steps(std::span<const FallRequest> requests,
                                         const LaneKernel& kernel) {
  return requests.empty() ? std::vector<FallSolution>{} : FallLanes(requests, kernel).solve();
}

}  // namespace oblique::solver
