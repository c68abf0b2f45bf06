#pragma once

#include <array>
#include <functional>
#include <memory>

#include "tests/worker/solver/reference/from_eliminated.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/reference/chain.h"
#include "worker/solver/reference/contact_law.h"
#include "worker/solver/reference/fall.h"
#include "worker/solver/reference/generalized_alpha.h"
#include "worker/solver/reference/motion.h"
#include "worker/solver/reference/solve_contact.h"
#include "worker/solver/solve.h"

namespace oblique::validation {

using solver::Point;

/// The ten distinct impacts of the paper.
inline constexpr std::array<Point, 10> kPublishedPoints{{{1.00, 0.4, 1.0},
                                                         {1.00, 0.4, 0.8},
                                                         {1.00, 0.4, 0.6},
                                                         {0.96, 0.4, 1.0},
                                                         {1.04, 0.4, 1.0},
                                                         {1.00, 0.6, 1.0},
                                                         {1.00, 0.8, 1.0},
                                                         {1.00, 1.2, 1.0},
                                                         {1.00, 1.4, 1.0},
                                                         {1.00, 1.6, 1.0}}};

/// Solves contacts of one chain with both integrators. Both contacts start from the same state, at
/// the end of an explicit fall. So the results differ only by the errors in the contact.
class BothWays {
 public:
  explicit BothWays(const solver::ModelParameters& model)
      : model_(model),
        chain_(model),
        explicit_(chain_),
        generalized_alpha_(model),
        fall_(solver::solve_stepped_fall(chain_, kFallStep_s)) {}

  const solver::Chain& chain() const { return chain_; }
  const solver::ExplicitMotion& by_explicit() const { return explicit_; }
  const solver::GeneralizedAlphaMotion& by_generalized_alpha() const { return generalized_alpha_; }
  const solver::Fall& fall() const { return *fall_; }

  /// Return the state at touch in the coordinates of each integrator.
  solver::ChainState explicit_touch(double H_m) const { return fall_->state_at(H_m); }
  solver::ChainState generalized_alpha_touch(double H_m) const {
    return from_eliminated(generalized_alpha_.chain(), fall_->state_at(H_m));
  }
  solver::ContactParameters contact(const Point& point) const {
    return {model_.k_N_m, model_.eta2, point.mu, point.e_star};
  }
  /// Return the result of a contact in steps of dt_s, reactions included.
  solver::CaseResult explicit_case(const Point& point, double dt_s) const {
    return solver::solve_contact(explicit_, contact(point), {dt_s, dt_s}, explicit_touch(point.H_m),
                                 {});
  }
  solver::CaseResult generalized_alpha_case(const Point& point, double dt_s) const {
    return solver::solve_contact(generalized_alpha_, contact(point), {dt_s, dt_s},
                                 generalized_alpha_touch(point.H_m), {});
  }

 private:
  /// Step of the fall [s]. It gives the speed at touch a relative error of 1e-10.
  static constexpr double kFallStep_s = 2e-6;

  solver::ModelParameters model_;
  solver::Chain chain_;
  solver::ExplicitMotion explicit_;
  solver::GeneralizedAlphaMotion generalized_alpha_;
  std::shared_ptr<const solver::Fall> fall_;
};

}  // namespace oblique::validation
