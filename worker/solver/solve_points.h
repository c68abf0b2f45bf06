#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <utility>

#include "worker/solver/contact/solve_contact.h"
#include "worker/solver/falls.h"
#include "worker/solver/solve.h"
#include "worker/solver/step_choice.h"

namespace oblique::solver {

/// What copies of a Finger share: the model, its steps in contact, and the fall, solved or not yet.
class Finger::Parts {
 public:
  explicit Parts(const ModelParameters& model)
      : model_(validated(model)),
        prepared_(std::make_shared<const PreparedChain>(model)),
        steps_(prepared_->chain(), model) {}
  Parts(const ModelParameters& model, std::shared_ptr<const FallenChain> fallen)
      : model_(validated(model)),
        prepared_(fallen->prepared()),
        steps_(prepared_->chain(), model),
        fall_({std::move(fallen), {}}) {
    if (!(fall_model(model) == prepared_->model())) {
      throw std::invalid_argument("the fall is of another model");
    }
    std::call_once(fall_once_, [] {});
  }

  const ModelParameters& model() const { return model_; }
  const std::shared_ptr<const PreparedChain>& prepared() const { return prepared_; }
  const StepChoice& steps() const { return steps_; }

  /// Throws SolveError when the fall has no end, again and at once for every point: what one long
  /// computation has said need not be computed again.
  const std::shared_ptr<const FallenChain>& fallen() const {
    std::call_once(fall_once_, [this] { fall_ = solve_falls({&prepared_, 1}).front(); });
    if (!fall_.fallen) {
      throw SolveError(fall_.error);
    }
    return fall_.fallen;
  }
  const Fall& fall() const { return fallen()->fall(); }

  /// Throws InputError for a value outside its range, a step that is too long, an H never reached.
  void check(double H_m, double mu, double e_star) const {
    validate_point(model_, H_m, mu, e_star);
    steps_.contact(e_star);
    if (H_m > fall().largest_drop_m()) {
      fall().state_at(H_m);
    }
  }
  ContactParameters contact_parameters(double mu, double e_star) const {
    return {model_.k_N_m, model_.eta2, mu, e_star};
  }
  void sign(SolverReport& report) const {
    report.integrator = integrator_name(model_.integrator);
    report.version = solver_version();
  }
  CaseResult solve_by_motion(const PointRequest& point, const Tracing& tracing) const {
    ChainState touch = fall().state_at(point.H_m);
    const double fall_time_s = touch.t_s;
    CaseResult result =
        solve_contact(prepared_->motion(), contact_parameters(point.mu, point.e_star),
                      steps_.contact(point.e_star), std::move(touch), tracing);
    result.H_m = point.H_m;
    result.fall_time_s = fall_time_s;
    sign(result.solver);
    return result;
  }

 private:
  static const ModelParameters& validated(const ModelParameters& model) {
    validate(model);
    return model;
  }

  ModelParameters model_;
  std::shared_ptr<const PreparedChain> prepared_;
  StepChoice steps_;
  mutable std::once_flag fall_once_;
  mutable FallOutcome fall_;
};

/// solve_points, each contact traced.
void solve_points(const std::function<std::optional<FingerPoint>()>& source,
                  const std::function<void(PointOutcome&&)>& sink, const Tracing& tracing);

}  // namespace oblique::solver
