#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "client/io/progress.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// One refinement: a model and its name, such as "n = 8".
struct Level {
  std::string name;
  solver::ModelParameters model;
};

/// Meshes from `coarsest` to `finest` elements per link, doubled each time. The explicit integrator
/// chooses its steps on each mesh; the steps of generalized-alpha do not depend on the mesh. Throws
/// InputError unless finest is coarsest times 4, 8, 16, ...
std::vector<Level> mesh_levels(const solver::ModelParameters& model, int coarsest, int finest);

/// Steps of contact and fall, both halved each time. The first step is the shortest that the model
/// takes in the contact at `e_star`. If the tolerance controls the fall's steps, all levels share
/// the fall; see exact_fall_level().
std::vector<Level> step_levels(const solver::ModelParameters& model, double e_star, int halvings);

/// The same contact as `level` on a fall with a tenth of the tolerance, which shows the error of
/// the fall. Nothing if the fall has a step to halve.
std::optional<Level> exact_fall_level(const Level& level);

struct ContactPoint {
  double H_m;
  double mu;
  double e_star;
};

struct SolvedLevel {
  Level level;
  solver::CaseResult result;
  double wall_s = 0.0;  ///< fall and contact
};

/// Solves `point` on all levels in parallel. Levels with the same fall share it. `line` shows
/// progress; `after_each` is called when a level ends, from its thread, one call at a time. Throws
/// InputError and SolveError as the solver does.
std::vector<SolvedLevel> solve_levels(const std::vector<Level>& levels, const ContactPoint& point,
                                      StatusLine& line,
                                      const std::function<void(const SolvedLevel&)>& after_each);

/// Behaviour of a sequence of values whose mesh or step is halved each time.
enum class Trend {
  kTooFew,       ///< fewer than three values
  kRounding,     ///< the last two values differ only by rounding
  kMonotone,     ///< the last two differences have the same sign, and the last is smaller
  kOscillating,  ///< the last two differences have different signs, and the last is smaller
  kUnsettled,    ///< the last difference is not, or hardly, smaller: no limit is visible
};

/// Richardson's extrapolation of a sequence v_1, v_2, ..., v_m. With d_1 = v_{m-1} - v_{m-2} and
/// d_2 = v_m - v_{m-1}: order p = log2 |d_1 / d_2|, limit = v_m + d_2 / (2^p - 1), error = |limit -
/// v_m| for monotone values. If p exceeds the theoretical order P, the last difference is small by
/// chance: the error is then computed with |d_1| 2^-P for |d_2| and with p = P. Oscillating values
/// are not extrapolated: limit = v_m, error = max(|d_2|, |d_1| 2^-P). Unsettled values, including
/// those of an order below kLeastOrder, have the larger difference as error; it is no bound.
inline constexpr double kLeastOrder = 0.4;
struct Extrapolation {
  Trend trend = Trend::kTooFew;
  double limit = 0.0;
  std::optional<double> order;  ///< observed order; only for monotone values
  std::optional<double> error;  ///< estimated error of the last value; needs two values
};

/// Extrapolates `values`, coarsest first; not empty. `highest_order` is P. Differences below
/// `resolution`, in the unit of the values, are rounding.
Extrapolation extrapolate(std::span<const double> values, double highest_order, double resolution);

/// A part of a contact that the solution on another level lacks. It marks a grazing event: for
/// example, V_n touches zero and its sign may or may not change.
struct ContactChange {
  enum class Kind {
    kCompression,  ///< two turns: compression starts again
    kRestitution,  ///< two turns: restitution, then compression continues
    kStick,        ///< P comes to rest
    kSlip,         ///< P slides between two sticks
    kRipple,       ///< a peak near the depth below which ripples are merged; no event
  };
  Kind kind;
  double t0_s;  ///< from touch
  double t1_s;
  bool in_finer;                ///< false: only the coarser solution has it
  std::size_t finer_level = 0;  ///< number of the finer level
};

/// The differences between the contacts on two levels, turns first, in order of time. Events of one
/// kind are matched in order; the pairs left out are those that bring the times of the others
/// closest. Empty if both have the same events and major peaks.
std::vector<ContactChange> changes_between(const solver::CaseResult& coarser,
                                           const solver::CaseResult& finer);

/// "a restitution of 5.97 us, from 187.58 to 193.55 us (V_n grazes 0)".
std::string described(const ContactChange& change);

/// "restitution", "stick", ...
const char* name_of(ContactChange::Kind kind);

/// `longer` and `shorter` are ascending times; their lengths differ by an even number. Returns the
/// first index of each pair of neighbours to leave out of `longer` so that the sum of |differences|
/// to `shorter` is least.
std::vector<std::size_t> lone_pairs(const std::vector<double>& longer,
                                    const std::vector<double>& shorter);

/// A scalar output of a contact.
struct Output {
  std::string name;  ///< with its unit; `major_peak_2_N` is the second peak
  double value;
  /// Scale for errors: largest force, duration, speed at touch, ... Digits below 1e-9 of it are
  /// rounding.
  double scale;
  /// States up to the instant of the value, ripples merged. Values of two levels are the same
  /// quantity only if these are equal.
  std::string mode;
};

/// Peak forces, major peaks, duration, stick, slide, impulses, exit velocity and largest reactions
/// (reaction_0_N at the pin, reaction_1_N at the first joint, ...).
std::vector<Output> outputs_of(const solver::CaseResult& result);

struct OutputConvergence {
  std::string name;
  double scale;  ///< of the finest level
  /// one per level, coarsest first; nothing if the mode before differs from the finest level's
  std::vector<std::optional<double>> values;
  /// of the finest levels that have the value, without a gap
  Extrapolation extrapolation;

  double finest() const { return *values.back(); }
};

struct PointConvergence {
  std::vector<OutputConvergence> outputs;
  std::vector<ContactChange> changes;  ///< differences between neighbouring levels
  /// Whether the finest three levels have the same mode, ripples merged. Outputs have a visible
  /// limit only then.
  bool has_one_mode = false;
};

/// Compares the results of one point, coarsest level first. `highest_order` is the theoretical
/// order.
PointConvergence convergence_of(std::span<const solver::CaseResult> results, double highest_order);

/// |value - limit| / |limit|; nothing if either is missing or the limit is 0.
std::optional<double> relative_error(const std::optional<double>& value, double limit);

struct Refinement {
  std::string what;  ///< "mesh" or "step"
  std::vector<SolvedLevel> levels;
  PointConvergence convergence;
};

/// Compares `levels`, coarsest first.
Refinement refinement_of(std::string what, std::vector<SolvedLevel> levels);

/// Whether all outputs approach a limit: the finest three levels have the same mode, and
/// differences decrease or are below a thousandth of the output's scale.
bool converges(const Refinement& refinement);

/// Prints a table of the outputs, the events that come and go, and the verdict.
void print_refinement(std::ostream& out, const Refinement& refinement);

/// Levels, outputs, changes and verdict as one JSON object.
nlohmann::ordered_json json_of(const Refinement& refinement);

/// "A fall solved for 1e-06 instead of 1e-05 changes outputs by at most ... %". Compares the first
/// level of `step` with the same contact on the fall of exact_fall_level().
std::string fall_sentence(const Refinement& step, const SolvedLevel& exact_fall);

/// The same comparison as a JSON object.
nlohmann::ordered_json json_of_fall(const Refinement& step, const SolvedLevel& exact_fall);

}  // namespace oblique::client
