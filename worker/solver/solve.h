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

/// The instruction set that the solver uses on this machine: "avx512", "avx2" or "baseline".
std::string instruction_set();

/// A point of a model.
struct Point {
  double H_m;     ///< drop of the tip at touch
  double mu;      ///< coefficient of friction
  double e_star;  ///< Stronge's energetic coefficient of restitution (e* in eqs. 17 and 22)
};

/// Solves points of one model. Copies are cheap and share everything. Const members may be called
/// by several threads at once. A point's result has the same bits whatever is solved before or
/// beside it.
class Finger {
 public:
  class Parts;  ///< of the implementation

  /// The fall is solved when it is first needed, or comes from `falls`. Throws InputError when
  /// `model` is outside its domain.
  explicit Finger(const ModelParameters& model = {}, std::shared_ptr<FallCache> falls = {});
  /// Uses a solved fall. Throws InputError when `model` is outside its domain,
  /// std::invalid_argument when the fall is that of another model.
  Finger(const ModelParameters& model, std::shared_ptr<const FallenChain> fallen);

  const ModelParameters& model() const;

  /// Largest drop of the tip before it first turns back [m], which is the largest H. Throws
  /// SolveError when the fall has no answer.
  double largest_drop_m() const;

  /// Drop of the tip so far [m] while another thread solves the fall.
  double drop_so_far_m() const;

  /// Solves one point. The calling thread passes each instant to `tracing.sink`; an exception of
  /// the sink ends the solution and is passed on. Throws InputError for a value outside its range,
  /// SolveError when there is no answer.
  CaseResult solve(double H_m, double mu, double e_star, const Tracing& tracing = {}) const;

  /// For the implementation.
  const std::shared_ptr<const Parts>& parts() const { return parts_; }

 private:
  std::shared_ptr<const Parts> parts_;
};

/// A point of a finger, with the caller's number.
struct FingerPoint {
  Finger finger;
  std::uint64_t number;
  Point point;
};

/// Returns the next point, nothing at the end.
using FingerPoints = std::function<std::optional<FingerPoint>()>;
using TakeOutcome = std::function<void(Outcome&&)>;

/// Solves the points of `source`, of any fingers, side by side in vector lanes where integrator and
/// shape of the chains allow. Passes each outcome to `sink` as soon as it is known. Fastest when
/// points of one finger and of equal H follow each other: they share the state at touch. Traces
/// each contact if `tracing` has a sink. Errors of points are in their outcomes; throws only what
/// `source` and `sink` throw.
void solve_points(const FingerPoints& source, const TakeOutcome& sink, const Tracing& tracing = {});

/// The same for points of one finger; outcomes are in their order.
std::vector<Outcome> solve_points(const Finger& finger, std::span<const Point> points,
                                  const Tracing& tracing = {});

}  // namespace oblique::solver
