#include "worker/solver/library/solver.h"

#include <mutex>
#include <optional>
#include <utility>

#include "worker/solver/estimate.h"
#include "worker/solver/library/falls_kept.h"
#include "worker/solver/library/point_runs.h"
#include "worker/solver/model/version.h"
#include "worker/solver/solve.h"

namespace oblique {

/// What copies of a finger share: the model, and the solver over its fall once that is solved.
class Finger::Parts {
 public:
  Parts(const ModelParameters& model, Falls falls) : model_(model), falls_(std::move(falls)) {
    validate(model);
    if (model.dt_fall_s != 0.0) {
      const solver::PreparedChain checked(model);  // throws where that step is too long
    }
  }

  const ModelParameters& model() const { return model_; }
  solver::FallCache& falls() const { return falls_.cache()->falls; }

  /// Throws SolveError when the fall has no answer.
  const solver::Finger& solving() const {
    std::call_once(once_, [this] { fall_ = falls().fall(model_); });
    if (!fall_.fallen) {
      throw SolveError(fall_.error);
    }
    std::call_once(set_up_, [this] { solving_.emplace(model_, fall_.fallen); });
    return *solving_;
  }

 private:
  const ModelParameters model_;
  const Falls falls_;
  mutable std::once_flag once_;
  mutable std::once_flag set_up_;
  mutable solver::FallOutcome fall_;
  mutable std::optional<solver::Finger> solving_;
};

std::string version() {
  return solver::solver_version();
}

std::string instruction_set() {
  return solver::instruction_set();
}

Falls::Falls(std::size_t most_bytes) : cache_(std::make_shared<Cache>(most_bytes)) {}

Finger::Finger(const ModelParameters& model, Falls falls)
    : parts_(std::make_shared<const Parts>(model, std::move(falls))) {}

const ModelParameters& Finger::model() const {
  return parts_->model();
}

double Finger::largest_drop_m() const {
  return parts_->solving().largest_drop_m();
}

CaseResult Finger::solve(double H_m, double mu, double e) const {
  solver::validate_point(model(), H_m, mu, e);  // said before a fall is solved for it
  return parts_->solving().solve(H_m, mu, e);
}

CaseResult Finger::trace(double H_m, double mu, double e, const Tracing& tracing) const {
  solver::validate_point(model(), H_m, mu, e);
  return parts_->solving().solve(H_m, mu, e, tracing);
}

ErrorEstimate Finger::estimated_errors(const CaseResult& result) const {
  return solver::errors_by_companion(model(), result,
                                     [this](std::span<const ModelParameters> models) {
                                       return solver::falls_of(parts_->falls(), models);
                                     });
}

}  // namespace oblique
