#include "worker/solver/fall/collocation_fall.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "worker/solver/chain/instruction_sets.h"
#include "worker/solver/fall/collocation_lanes.h"
#include "worker/solver/fall/collocation_path.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::solver {
namespace {

/// A step is as long as leaves this times the accuracy asked for unresolved, in parts of sqrt(g
/// length): README.md.
constexpr double kUnresolved = 1.5;
/// First step, in parts of sqrt(length/g).
constexpr double kFirstStep = 1.0 / 4000.0;
/// No step is longer, in the same parts: the chain turns by some 0.1 then.
constexpr double kLongestStep = 1.0 / 100.0;
/// Newton's method leaves positions this wrong at most, in parts of the length and of the accuracy.
constexpr double kPositionError = 1e-8;
constexpr double kSmallestPositionError = 1e-15;
/// Steps in a fall beyond which it is given up.
constexpr std::size_t kMostSteps = 2'000'000;
/// Halvings in a row after which a fall is given up.
constexpr int kMostHalvings = 30;

/// How long steps are. Changed seldom and by little: while it does not change, the method is
/// symplectic.
class StepControl {
 public:
  StepControl(double timescale_s, double allowed_m_s)
      : h_s_(kFirstStep * timescale_s),
        longest_s_(kLongestStep * timescale_s),
        allowed_m_s_(allowed_m_s) {}

  double h_s() const { return h_s_; }

  /// True when the step is to be taken; false when it is to be tried again with the new h_s().
  bool accepts(const CollocationLanes::Attempt& attempt) {
    const double error = attempt.unresolved_m_s / allowed_m_s_;
    if (!attempt.converged || error > kRefused) {
      ++halvings_;
      change(0.5);
      return false;
    }
    halvings_ = 0;
    mean_square_ += kWeight * (error * error - mean_square_);
    ++steps_;
    const double mean = std::sqrt(mean_square_);
    if (attempt.iterations >= kManyIterations) {
      change(0.8);
    } else if (steps_ >= kPatience && (mean > 1.0 + kBand || mean < 1.0 - kBand)) {
      // What is unresolved falls as h^1.4 where it is vibrations of a released chain.
      change(std::clamp(std::pow(std::max(mean, 1e-6), -0.7), 0.5, 1.5));
    }
    return true;
  }
  bool is_hopeless() const { return halvings_ > kMostHalvings; }

 private:
  static constexpr double kRefused = 4.0;
  static constexpr double kWeight = 0.125;
  static constexpr double kBand = 0.15;
  static constexpr int kPatience = 16;
  static constexpr int kManyIterations = 6;

  void change(double factor) {
    const double longer_s = std::min(factor * h_s_, longest_s_);
    if (longer_s != h_s_) {
      h_s_ = longer_s;
      steps_ = 0;
      mean_square_ = 1.0;
    }
  }

  double h_s_;
  double longest_s_;
  double allowed_m_s_;
  double mean_square_ = 1.0;
  int steps_ = 0;
  int halvings_ = 0;
};

/// A fall on its way, in a lane.
class FallingChain {
 public:
  FallingChain(const CollocationKernel& kernel, const std::shared_ptr<const GaussCollocation>& rule,
               const FallRequest& request, FallSolution& solution)
      : request_(request),
        solution_(solution),
        length_m_(request.chain->tip(request.chain->at_rest()).x_m),
        longest_s_(longest_fall_s(*request.chain)),
        error_m_(length_m_ * std::max(kSmallestPositionError, kPositionError * request.accuracy)),
        path_(std::make_shared<CollocationPath>(kernel, rule, *request.chain, *request.model,
                                                error_m_)),
        control_(std::sqrt(length_m_ / gravity_m_s2()),
                 kUnresolved * request.accuracy * std::sqrt(length_m_ * gravity_m_s2())) {}

  double h_s() const { return control_.h_s(); }
  double error_m() const { return error_m_; }

  enum class Fate { kAgain, kOn, kOver };
  /// Takes what became of a step: it is to be tried again, or accepted, or the fall is over, one
  /// way or the other.
  Fate take(const CollocationLanes::Attempt& attempt, const CollocationLanes& lanes,
            std::size_t lane) {
    const double h_s = control_.h_s();
    if (!control_.accepts(attempt)) {
      return control_.is_hopeless() ? fail("the fall could not be solved on from t = " +
                                           readable_number(path_->time_s()) + " s: steps of " +
                                           readable_number(h_s) + " s still do not converge")
                                    : Fate::kAgain;
    }
    const double y_m = lanes.q(lane, 2 * static_cast<std::size_t>(request_.chain->tip_row()) + 1);
    if (!(std::abs(y_m) <= 2.0 * length_m_)) {
      return fail("the fall diverged at t = " + readable_number(path_->time_s()) + " s");
    }
    if (path_->append(lanes, lane, h_s)) {
      solution_.path = path_;
      return Fate::kOver;
    }
    if (path_->time_s() > longest_s_) {
      return fail("the tip did not turn back within " + readable_number(longest_s_) +
                  " s of falling");
    }
    if (path_->steps() >= kMostSteps) {
      return fail("the fall would take more than " + exact_number(static_cast<double>(kMostSteps)) +
                  " steps");
    }
    if (request_.progress != nullptr) {
      request_.progress->reach(path_->time_s(), -y_m);
    }
    return Fate::kOn;
  }

 private:
  double gravity_m_s2() const { return request_.chain->gravity_m_s2(); }
  Fate fail(std::string why) {
    solution_.error = std::move(why);
    return Fate::kOver;
  }

  const FallRequest& request_;
  FallSolution& solution_;
  double length_m_;
  double longest_s_;
  double error_m_;
  std::shared_ptr<CollocationPath> path_;
  StepControl control_;
};

std::vector<CollocationKernel> find_kernels() {
  std::vector<CollocationKernel> kernels;
#if defined(__x86_64__)
  if (has_avx512()) {
    kernels.push_back(avx512_collocation());
  }
  if (has_avx2()) {
    kernels.push_back(avx2_collocation());
  }
#endif
  kernels.push_back(baseline_collocation());
  return kernels;
}

}  // namespace

std::span<const CollocationKernel> runnable_collocation_kernels() {
  static const std::vector<CollocationKernel> kernels = find_kernels();
  return kernels;
}

std::vector<FallSolution> solve_by_collocation(std::span<const FallRequest> requests,
                                               const CollocationKernel& kernel) {
  std::vector<FallSolution> solutions(requests.size());
  if (requests.empty()) {
    return solutions;
  }
  for (const FallRequest& request : requests) {
    if (!have_one_shape(request.chain->tables(), requests.front().chain->tables())) {
      throw std::invalid_argument("falls side by side are of chains of one shape");
    }
  }
  const auto rule = std::make_shared<const GaussCollocation>(kernel.stages);
  CollocationLanes lanes(kernel, *rule, *requests.front().chain, *requests.front().model);
  std::vector<std::optional<FallingChain>> falling(lanes.lanes());
  std::vector<double> h_s(lanes.lanes());
  std::vector<double> error_m(lanes.lanes());
  std::vector<CollocationLanes::Attempt> attempts(lanes.lanes());
  std::vector<unsigned char> accept(lanes.lanes());
  std::size_t next = 0;
  for (;;) {
    bool any = false;
    for (std::size_t lane = 0; lane < lanes.lanes(); ++lane) {
      std::optional<FallingChain>& here = falling[lane];
      if (!here && next < requests.size()) {
        lanes.load(lane, *requests[next].chain, *requests[next].model);
        here.emplace(kernel, rule, requests[next], solutions[next]);
        ++next;
      }
      h_s[lane] = here ? here->h_s() : 0.0;
      error_m[lane] = here ? here->error_m() : 0.0;
      any = any || here;
    }
    if (!any) {
      return solutions;
    }
    lanes.attempt(h_s, error_m, attempts);
    for (std::size_t lane = 0; lane < lanes.lanes(); ++lane) {
      accept[lane] = 1;
      if (!falling[lane]) {
        continue;
      }
      const FallingChain::Fate fate = falling[lane]->take(attempts[lane], lanes, lane);
      accept[lane] = fate == FallingChain::Fate::kOn ? 1 : 0;
      if (fate == FallingChain::Fate::kOver) {
        falling[lane].reset();
      }
    }
    lanes.settle(accept);
  }
}

}  // namespace oblique::solver
