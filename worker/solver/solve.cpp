#include "worker/solver/solve.h"

#include <optional>
#include <string>
#include <utility>

#include "worker/solver/lanes/lane_stepper.h"
#include "worker/solver/motion/trace_of_chain.h"
#include "worker/solver/solve_points.h"

namespace oblique::solver {

std::string instruction_set() {
  return std::string(runnable_lane_kernels().front().name);
}

Finger::Finger(const ModelParameters& model) : parts_(std::make_shared<const Parts>(model)) {}
Finger::Finger(const ModelParameters& model, std::shared_ptr<const FallenChain> fallen)
    : parts_(std::make_shared<const Parts>(model, std::move(fallen))) {}

const ModelParameters& Finger::model() const {
  return parts_->model();
}
double Finger::largest_drop_m() const {
  return parts_->fall().largest_drop_m();
}
const FallProgress& Finger::fall_progress() const {
  return parts_->prepared()->fall_progress();
}

CaseResult Finger::solve(double H_m, double mu, double e_star) const {
  return solve(H_m, mu, e_star, Tracing{});
}

CaseResult Finger::solve(double H_m, double mu, double e_star, const Tracing& tracing) const {
  parts_->check(H_m, mu, e_star);
  if (tracing.sink && tracing.with_fall) {
    trace_fall(parts_->prepared()->motion(), parts_->fall(), H_m, tracing);
  }
  std::optional<FingerPoint> point = FingerPoint{*this, {0, H_m, mu, e_star}};
  PointOutcome outcome{};
  solver::solve_points([&point] { return std::exchange(point, std::nullopt); },
                       [&outcome](PointOutcome&& o) { outcome = std::move(o); }, tracing);
  if (!outcome.result) {
    throw SolveError(outcome.error);
  }
  return std::move(*outcome.result);
}

void Finger::solve_points(const std::function<std::optional<PointRequest>()>& source,
                          const std::function<void(PointOutcome&&)>& sink) const {
  solver::solve_points(
      [&]() -> std::optional<FingerPoint> {
        const auto point = source();
        return point ? std::optional(FingerPoint{*this, *point}) : std::nullopt;
      },
      sink);
}

}  // namespace oblique::solver
