#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "worker/solver/model/case_result.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/model/trace.h"

/// The oblique impact of a flexible robotic finger on rough ground, as a library.
///
/// A chain of slender elastic links hangs from a pin O and falls from rest, straight and level. Its
/// tip strikes the ground a drop H below O, and keeps contact through a normal and a tangential
/// spring with friction and losses, until it leaves the ground. The links are absolute nodal
/// coordinate elements (equations 1 to 16 of the paper, "Oblique impact for flexible robotic finger
/// system"), the contact is its local compliant model (equations 17 to 24). What had to be
/// corrected in them stands in worker/solver/README.md of the sources.
///
///     #include <oblique/solver.h>
///     const oblique::Finger finger;                        // the preset `standard`
///     const auto impact = finger.solve(1.0, 0.4, 1.0);     // H = 1 m, mu = 0.4, e = 1
///     std::cout << impact.fn_peak_N << " N, " << impact.mode << '\n';
///
/// Units are SI, and stand at the end of names. x points along the ground away from O, y upwards;
/// forces act on the tip; times count from touch. Angles do not occur.
///
/// Versions: releases 0.x.y of equal x take each other's place without a new link; one of another x
/// does not, and its library has another SONAME (liboblique.so.0.x). A release of equal x gives the
/// same bits for the same input on every machine, whatever its instruction set, for all but
/// SolverReport::wall_s.
namespace oblique {

using solver::CaseResult;       ///< what solving a point gave
using solver::ErrorEstimate;    ///< estimated errors of outputs
using solver::InputError;       ///< a value outside its range: message names key, value, range
using solver::Integrator;       ///< how the equations of motion are stepped
using solver::ModelParameters;  ///< the finger, ground and method; the default is `standard`
using solver::SolveError;       ///< a point that has no answer: message says why
using solver::TraceRow;         ///< one instant of a contact
using solver::Tracing;          ///< what is wanted of the instants, and where they go

// Parameters by their names, their ranges, and presets: solver/parameters.h.
using solver::find_model_key;
using solver::model_keys;
using solver::preset;
using solver::validate;

/// Version of the library that is linked, as "0.2.0".
std::string version();

/// The instruction set that it uses on this machine: "avx512", "avx2" or "baseline".
std::string instruction_set();

/// Falls that fingers share, the longest part of a first point: until the tip touches, nothing
/// depends on k, eta2, mu, e or the step in contact, and one fall passes every H. Keeps those used
/// last. Copies share one memory. May be used by several threads at once.
class Falls {
 public:
  /// Falls of more than so many bytes together are forgotten, the last one aside.
  explicit Falls(std::size_t most_bytes = std::size_t{1} << 30U);

  class Cache;  ///< of the implementation
  const std::shared_ptr<Cache>& cache() const { return cache_; }

 private:
  std::shared_ptr<Cache> cache_;
};

/// Solves points of one model. Copies are cheap and share everything. All members may be called by
/// several threads at once. A point gives the same bits whatever was solved before or beside it.
class Finger {
 public:
  /// Throws InputError when `model` is outside its domain. The fall is solved when first needed.
  explicit Finger(const ModelParameters& model = {}, Falls falls = Falls());

  const ModelParameters& model() const;

  /// Largest drop of the tip before it first turns back [m]: the largest H. Throws SolveError when
  /// the fall has no answer.
  double largest_drop_m() const;

  /// The impact after a drop `H_m` [m] with the coefficient of friction `mu` and Stronge's
  /// energetic coefficient of restitution `e` (e* in equations 17 and 22). Throws InputError for a
  /// value outside its range, SolveError when there is no answer.
  CaseResult solve(double H_m, double mu, double e) const;

  /// The same; `tracing.sink` is called with each instant, by the calling thread. What it throws
  /// ends the solution and comes out here.
  CaseResult trace(double H_m, double mu, double e, const Tracing& tracing) const;

  /// Estimated errors of a result of this finger, from a second solution on half the mesh and with
  /// twice the step; all absent where there is no coarser mesh or that has no answer. Those of
  /// forces and impulses are fractions of the normal one, those of times of the duration, that of
  /// the slide of the speed at touch times the duration, that of the velocity out of the speed at
  /// touch.
  ErrorEstimate estimated_errors(const CaseResult& result) const;

  class Parts;  ///< of the implementation

 private:
  std::shared_ptr<const Parts> parts_;
};

/// A point to solve, beside others.
struct Point {
  double H_m;             ///< drop of the tip at touch
  double mu;              ///< coefficient of friction
  double e;               ///< coefficient of restitution
  std::size_t model = 0;  ///< which of the models that are given with the points
};

/// What became of a point.
struct Outcome {
  std::size_t point;                 ///< its place among those given
  std::optional<CaseResult> result;  ///< empty: see `error`
  std::string error;                 ///< why there is no result, as a sentence
};

/// How many points are solved.
struct ManyOptions {
  std::size_t threads = 0;  ///< 0: one a core that this process may use
  bool errors = false;      ///< estimate errors too, at about a quarter more time
  /// Asked by the calling thread every 50 ms or so, with the number of outcomes so far. False, and
  /// anything that it throws, ends the work; may be none.
  std::function<bool(std::size_t outcomes)> goes_on = {};
  Falls falls = Falls();
};

/// Solves points side by side, on many threads and in all lanes of their vector registers, and
/// hands each outcome to `take`, one at a time, by threads of its own and in any order. Points may
/// be in any order: those that share a fall, a drop or a contact's beginning are brought together.
/// Returns true when all were handed on, and false when `goes_on` was false; then, and when `take`
/// or `goes_on` throws, what is under way may be given up, and nothing is handed on behind the
/// return. Nothing is thrown for a point without an answer, nor for a model or a value outside its
/// range: its outcome says why. Throws InputError for a point whose model is not there, and what
/// `take` or `goes_on` throw. May be called by several threads at once.
bool solve_many(std::span<const ModelParameters> models, std::span<const Point> points,
                const std::function<void(Outcome&&)>& take, const ManyOptions& options = {});

}  // namespace oblique
