#include "tests/validation/both_ways.h"

#include "worker/solver/reference/solve_contact.h"

namespace oblique::validation {
namespace {

/// At 2 us the fall's own error is 1e-10 of the speed.
constexpr double kFallStep_s = 2e-6;

}  // namespace

BothWays::BothWays(const solver::ModelParameters& model)
    : model_(model),
      chain_(model),
      explicit_(chain_),
      generalized_alpha_(model),
      fall_(solver::solve_stepped_fall(chain_, kFallStep_s)) {}

solver::CaseResult BothWays::explicit_case(const Point& point, double dt_s) const {
  return solver::solve_contact(explicit_, contact(point), {dt_s, dt_s}, explicit_touch(point.H_m),
                               {});
}

solver::CaseResult BothWays::generalized_alpha_case(const Point& point, double dt_s) const {
  return solver::solve_contact(generalized_alpha_, contact(point), {dt_s, dt_s},
                               generalized_alpha_touch(point.H_m), {});
}

}  // namespace oblique::validation
