#include "worker/solver/fast/lane_falls.h"

#include <exception>
#include <new>
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
    for (;;) {
      bool is_any_falling = false;
      for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
        fill(lane);
        is_any_falling = is_any_falling || lanes_[lane].fall;
      }
      if (!is_any_falling) {
        return std::move(solutions_);
      }
      stepper_.step();
      for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
        end_if_over(lane);
      }
      stepper_.settle(all_);
      for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
        if (lanes_[lane].fall && lanes_[lane].fall->keeps_last()) {
          lanes_[lane].fall->keep(stored(lane));
        }
      }
    }
  }

 private:
  struct Lane {
    std::size_t number = 0;             ///< of the fall
    std::shared_ptr<SteppedFall> fall;  ///< none: the lane idles
  };

  /// Starts the next fall that can begin in an idle lane, if there is one.
  void fill(std::size_t lane) {
    while (!lanes_[lane].fall && next_ < requests_.size()) {
      const std::size_t number = next_++;
      const FallRequest& request = requests_[number];
      unless_it_fails(number, [&] {
        lanes_[lane] = {number, std::make_shared<SteppedFall>(request.motion, request.dt_s,
                                                              longest_fall_s(*request.chain),
                                                              request.progress)};
        const ChainState rest = request.chain->at_rest();
        stepper_.load(lane, request.chain->tables(), rest.q.data(), rest.v.data());
        stepper_.set_step(lane, request.dt_s);
        stepper_.set_force(lane, {});
      });
    }
  }

  /// At the end of a step, while the state before it can still be had.
  void end_if_over(std::size_t lane) {
    Lane& slot = lanes_[lane];
    if (!slot.fall) {
      return;
    }
    const auto tip_row = static_cast<std::size_t>(requests_[slot.number].chain->tip_row());
    const bool goes_on = unless_it_fails(slot.number, [&] {
      if (slot.fall->is_over_after_next(stepper_.trial_tip(lane, tip_row))) {
        slot.fall->end(stored(lane));
        solutions_[slot.number].fall = slot.fall;
      }
    });
    if (!goes_on || solutions_[slot.number].fall) {
      slot.fall.reset();
      stepper_.idle(lane);
    }
  }

  /// Calls `work` for a fall, whose error becomes its solution. False when it fails.
  template <class Work>
  bool unless_it_fails(std::size_t number, const Work& work) {
    try {
      work();
      return true;
    } catch (const std::bad_alloc&) {  // says nothing of this fall
      throw;
    } catch (const std::exception& error) {
      solutions_[number].error = error.what();
      return false;
    }
  }

  const ChainState& stored(std::size_t lane) {
    stepper_.store(lane, column_.q.data(), column_.v.data());
    return column_;
  }

  std::span<const FallRequest> requests_;
  std::vector<FallSolution> solutions_;
  LaneStepper stepper_;
  std::vector<Lane> lanes_;
  std::vector<unsigned char> all_;  ///< every lane takes each step
  ChainState column_;
  std::size_t next_ = 0;
};

}  // namespace

std::vector<FallSolution> solve_by_steps(std::span<const FallRequest> requests,
                                         const LaneKernel& kernel) {
  return requests.empty() ? std::vector<FallSolution>{} : FallLanes(requests, kernel).solve();
}

}  // namespace oblique::solver
