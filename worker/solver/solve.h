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

/// Solves points of one model. Copies are cheap and share all data. Several threads may call const
/// members at once. A result has the same bits whatever other points are solved.
class Finger {
 public:
  class Parts;  ///< implementation

  /// The fall comes from `falls` or is solved when first needed. Throws InputError for a bad model.
  explicit Finger(const ModelParameters& model = {}, std::shared_ptr<FallCache> falls = {});
  /// Uses a solved fall. Throws InputError when `model` is outside its domain,
  /// std::invalid_argument when the fall belongs to another model.
  Finger(const ModelParameters& model, std::shared_ptr<const FallenChain> fallen);

  const ModelParameters& model() const;

  /// Largest H: the drop at which the tip first turns back [m]. Throws SolveError if the fall
  /// fails.
  double largest_drop_m() const;

  /// Present drop of the tip [m] while another thread solves the fall.
  double drop_so_far_m() const;

  /// Solves one point and passes each instant to `tracing.sink`. Throws InputError for a value
  /// outside its range, SolveError when there is no answer, and exceptions of the sink.
  CaseResult solve(double H_m, double mu, double e_star, const Tracing& tracing = {}) const;

  const std::shared_ptr<const Parts>& parts() const { return parts_; }

 private:
  std::shared_ptr<const Parts> parts_;
};

struct FingerPoint {
  Finger finger;
  std::uint64_t number;  ///< chosen by the caller
  Point point;
};

/// Returns the next point, nothing at the end.
using FingerPoints = std::function<std::optional<FingerPoint>()>;
using TakeOutcome = std::function<void(Outcome&&)>;

/// Solves the points of `source`, which may belong to different fingers. Points are solved side by
/// side in vector lanes if their chains have one shape and the explicit integrator. Consecutive
/// points of one finger with equal H share the state at touch. Passes each outcome, error or
/// result, to `sink` as soon as it is known. Throws only exceptions of `source` and `sink`.
void solve_points(const FingerPoints& source, const TakeOutcome& sink, const Tracing& tracing = {});

/// Solves points of one finger. Returns the outcomes in the order of the points.
std::vector<Outcome> solve_points(const Finger& finger, std::span<const Point> points,
                                  const Tracing& tracing = {});

}  // namespace oblique::solver
