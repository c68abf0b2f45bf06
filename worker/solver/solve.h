#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "worker/solver/fall_cache.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/model/trace.h"

namespace oblique::solver {

/// Instruction set the solver runs with on this machine: "avx512", "avx2" or "baseline".
std::string instruction_set();

/// A point to solve.
struct Point {
  double H_m;     ///< drop of the tip at touch
  double mu;      ///< coefficient of friction
  double e_star;  ///< Stronge's energetic coefficient of restitution (e* in eqs. 17 and 22)
};

/// What became of a point.
struct Outcome {
  std::uint64_t number;              ///< the caller's
  std::optional<CaseResult> result;  ///< empty: see `error`
  std::string error;                 ///< why there is no result, as a sentence
};

/// Solves points of one model: its contact's parameters and steps over a fall, which models may
/// share. Copies are cheap and share everything. Const members may be called by several threads at
/// once. A point's result has the same bits whatever was solved before or beside it.
class Finger {
 public:
  class Parts;  ///< of the implementation

  /// The fall is solved once, when first needed, or comes from `falls`. Throws InputError when
  /// `model` is outside its domain.
  explicit Finger(const ModelParameters& model = {}, std::shared_ptr<FallCache> falls = {});
  /// Over a fall that is solved. Throws InputError when `model` is outside its domain,
  /// std::invalid_argument when its fall is another one.
  Finger(const ModelParameters& model, std::shared_ptr<const FallenChain> fallen);

  const ModelParameters& model() const;

  /// Largest drop of the tip before it first turns back [m]: the largest H. Throws SolveError when
  /// the fall has no answer.
  double largest_drop_m() const;

  /// Drop of the tip so far [m] while another thread solves the fall.
  double drop_so_far_m() const;

  /// Solves one point. `tracing.sink` is called with each instant, by the calling thread; what it
  /// throws ends the solution and comes out here. Throws InputError for a value outside its range,
  /// SolveError when there is no answer.
  CaseResult solve(double H_m, double mu, double e_star, const Tracing& tracing = {}) const;

  /// For the implementation.
  const std::shared_ptr<const Parts>& parts() const { return parts_; }

 private:
  std::shared_ptr<const Parts> parts_;
};

/// A point of a finger, under the caller's number.
struct FingerPoint {
  Finger finger;
  std::uint64_t number;
  Point point;
};

/// Gives the next point; none: there are no more.
using FingerPoints = std::function<std::optional<FingerPoint>()>;
using TakeOutcome = std::function<void(Outcome&&)>;

/// Solves the points that `source` gives, those of any fingers side by side in vector lanes where
/// integrator and shape of the chains allow, and hands each outcome to `sink`, in the order in
/// which they are done. Points of one finger and of equal H should follow each other: the state at
/// touch is found once for them. Throws nothing of its own; what goes wrong with a point is in its
/// outcome. With `tracing`, each contact is traced.
void solve_points(const FingerPoints& source, const TakeOutcome& sink, const Tracing& tracing = {});

/// The same for points of one finger; outcomes in their order.
std::vector<Outcome> solve_points(const Finger& finger, std::span<const Point> points);

}  // namespace oblique::solver
