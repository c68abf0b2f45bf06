#include "worker/solver/solve.h"

#include <mutex>
#include <optional>

#include "worker/solver/chain.h"
#include "worker/solver/fall.h"
#include "worker/solver/generalized_alpha.h"
#include "worker/solver/solve_contact.h"
#include "worker/solver/step_choice.h"

namespace oblique::solver {
namespace {

std::shared_ptr<const Motion> make_motion(const ModelParameters& model, const Chain& chain) {
  if (model.integrator == Integrator::kGeneralizedAlpha) {
    return std::make_shared<GeneralizedAlphaMotion>(model);
  }
  return std::make_shared<ExplicitMotion>(chain);
}

}  // namespace

struct Finger::Parts {
  explicit Parts(ModelParameters parameters)
      : model(std::move(parameters)),
        chain(model),
        steps(chain, model),
        motion(make_motion(model, chain)) {}

  const Fall& solved_fall() const {
    std::call_once(fall_once,
                   [this] { fall.emplace(motion, steps.fall_s(), longest_fall_s(chain)); });
    return *fall;
  }

  ModelParameters model;
  Chain chain;
  StepChoice steps;
  std::shared_ptr<const Motion> motion;
  mutable std::once_flag fall_once;
  mutable std::optional<Fall> fall;
};

std::string solver_version() {
  return OBLIQUE_SOLVER_VERSION;
}
std::string instruction_set() {
  return "generic";
}

Finger::Finger(ModelParameters model) : parts_(std::make_unique<Parts>(std::move(model))) {}
Finger::~Finger() = default;
Finger::Finger(Finger&&) noexcept = default;
Finger& Finger::operator=(Finger&&) noexcept = default;

const ModelParameters& Finger::model() const {
  return parts_->model;
}
double Finger::largest_drop_m() const {
  return parts_->solved_fall().largest_drop_m();
}

CaseResult Finger::solve(double H_m, double mu, double e_star) const {
  return solve(H_m, mu, e_star, Extras{});
}

CaseResult Finger::solve(double H_m, double mu, double e_star, const Extras& extras) const {
  validate_point(parts_->model, H_m, mu, e_star);
  const ContactSteps steps = parts_->steps.contact(e_star);
  ChainState touch = parts_->solved_fall().state_at(H_m);
  const double fall_time_s = touch.t_s;
  CaseResult result =
      solve_contact(*parts_->motion, {parts_->model.k_N_m, parts_->model.eta2, mu, e_star}, steps,
                    std::move(touch), extras);
  result.H_m = H_m;
  result.fall_time_s = fall_time_s;
  result.solver.integrator = integrator_name(parts_->model.integrator);
  result.solver.version = solver_version();
  return result;
}

}  // namespace oblique::solver
