#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "worker/solver/model/case_result.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/model/trace.h"
#include "worker/solver/model/version.h"
#include "worker/solver/motion/fall_progress.h"

namespace oblique::solver {

class FallenChain;  // falls.h

/// Instruction set the solver runs with on this machine, as "avx2".
std::string instruction_set();

/// A point to solve, under the caller's number.
struct PointRequest {
  std::uint64_t number;
  double H_m;
  double mu;
  double e_star;
};

/// What became of it: a result, or the reason why there is none.
struct PointOutcome {
  std::uint64_t number;
  std::optional<CaseResult> result;
  std::string error;
};

/// Solves points of one model: its contact's parameters and steps over a fall, which models may
/// share. Copies are cheap and share everything. Const members may be called from several threads
/// at once. A point's result has the same bits whatever was solved before or beside it.
class Finger {
 public:
  class Parts;  ///< of the implementation

  /// The fall is solved once, when first needed. Throws InputError when `model` is outside its
  /// domain.
  explicit Finger(const ModelParameters& model);
  /// Over a fall that is solved. Throws InputError when `model` is outside its domain,
  /// std::invalid_argument when its fall is another one.
  Finger(const ModelParameters& model, std::shared_ptr<const FallenChain> fallen);

  const ModelParameters& model() const;

  /// Largest drop of the tip before it first turns back [m]. Throws SolveError when the fall has no
  /// answer.
  double largest_drop_m() const;

  /// How far the fall is while another thread solves it; of a fall given at the start, where that
  /// ended. Lives as long as a copy of this.
  const FallProgress& fall_progress() const;

  /// Solves one point. Throws InputError for a value outside its range, SolveError when there is
  /// no answer.
  CaseResult solve(double H_m, double mu, double e_star) const;
  CaseResult solve(double H_m, double mu, double e_star, const Tracing& tracing) const;

  /// As the function below, for points of this finger alone.
  void solve_points(const std::function<std::optional<PointRequest>()>& source,
                    const std::function<void(PointOutcome&&)>& sink) const;

  /// For the implementation.
  const std::shared_ptr<const Parts>& parts() const { return parts_; }

 private:
  std::shared_ptr<const Parts> parts_;
};

struct FingerPoint {
  Finger finger;
  PointRequest point;
};

/// Solves the points that `source` gives until it gives nothing more, those of any fingers side by
/// side in vector lanes where integrator and shape of the chains allow, and hands each outcome to
/// `sink`, in the order in which they are done. Points of one finger and of equal H should follow
/// each other: the state at touch is found once for them. Throws nothing of its own; what goes
/// wrong with a point is in its outcome.
void solve_points(const std::function<std::optional<FingerPoint>()>& source,
                  const std::function<void(PointOutcome&&)>& sink);

}  // namespace oblique::solver
