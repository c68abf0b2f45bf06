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

/// One refinement: a model and its name, as "n = 8".
struct Level {
  std::string name;
  solver::ModelParameters model;
};

/// Meshes from `coarsest` to `finest` elements a link, doubled each time. The explicit integrator
/// chooses its steps on each mesh; those of generalized-alpha do not depend on the mesh and stay.
/// Throws InputError unless finest is coarsest times 4, 8, 16, ...
std::vector<Level> mesh_levels(const solver::ModelParameters& model, int coarsest, int finest);

/// Steps of contact and fall, both halved each time, from those that the model takes at e_star;
/// where restitution takes shorter steps, the shorter step throughout. Where the fall chooses its
/// steps by the tolerance, all levels share it; see exact_fall_level().
std::vector<Level> step_levels(const solver::ModelParameters& model, double e_star, int halvings);

/// `level` with the same contact on a fall solved for a tenth of the tolerance, which shows the
/// error of the fall. Nothing where the fall has a step to halve.
std::optional<Level> exact_fall_level(const Level& level);

struct ContactPoint {
  double H_m;
  double mu;
  double e_star;
};

/// A level with the result of the point on it.
struct SolvedLevel {
  Level level;
  solver::CaseResult result;
  double wall_s = 0.0;  ///< fall and contact
};

/// Solves `point` on every level, all levels side by side. Levels whose falls are the same share
/// one. `line` shows what is under way; `after_each` is called as each level ends, from its thread,
/// one call at a time. Throws InputError and SolveError as the solver does.
std::vector<SolvedLevel> solve_levels(const std::vector<Level>& levels, const ContactPoint& point,
                                      StatusLine& line,
                                      const std::function<void(const SolvedLevel&)>& after_each);

/// How values behave whose mesh or step is halved from one to the next.
enum class Trend {
  kTooFew,       ///< fewer than three values: nothing can be said
  kRounding,     ///< the last two values are the same but for rounding
  kMonotone,     ///< the last two differences have one sign, and the last is smaller
  kOscillating,  ///< the last difference is smaller and of the other sign
  kUnsettled,    ///< the last difference is not or hardly smaller: no limit to be seen
};

/// What a sequence v_1, v_2, ..., v_m says of its limit by Richardson's extrapolation. With
/// d_1 = v_{m-1} - v_{m-2} and d_2 = v_m - v_{m-1}:
///
///   order p = log2 |d_1 / d_2|,   limit = v_m + d_2 / (2^p - 1),   error = |limit - v_m|
///
/// for monotone values. Where p exceeds the order P that theory promises, the last difference is
/// small by luck: then d_2 is not believed to be smaller than d_1 2^-P, and p = P is used for the
/// error. Oscillating values are not extrapolated: limit = v_m, error = max(|d_2|, |d_1| 2^-P).
/// For unsettled values, those of an order below kLeastOrder among them, the error is the larger
/// difference, which bounds nothing.
inline constexpr double kLeastOrder = 0.4;
struct Extrapolation {
  Trend trend = Trend::kTooFew;
  double limit = 0.0;
  std::optional<double> order;  ///< observed; where the differences have one sign and fall
  std::optional<double> error;  ///< estimated, of the last value; with two values or more
};

/// Extrapolates `values`, coarsest first; not empty. `highest_order` is P. Differences below
/// `resolution` (in the values' unit) are rounding.
Extrapolation extrapolate(std::span<const double> values, double highest_order, double resolution);

/// A part of one contact that another solution of the same point does not have: the mark of an
/// event that grazes its condition, as a V_n that touches zero and may or may not pass it.
struct ContactChange {
  enum class Kind {
    kCompression,  ///< two turns: compression starts again for a while
    kRestitution,  ///< two turns: restitution for a while, then compression goes on
    kStick,        ///< P comes to rest for a while
    kSlip,         ///< P slides for a while between two sticks
    kRipple,       ///< no event: a peak near the depth at which ripples are merged
  };
  Kind kind;
  double t0_s;  ///< since touch
  double t1_s;
  bool in_finer;                ///< whether the finer solution has it, or the coarser
  std::size_t finer_level = 0;  ///< number of the finer solution's level
};

/// What one of two solutions of a point has and the other has not, turns first, in the order of
/// time. Events of one kind are put beside each other in their order, and those stay alone whose
/// leaving out brings the times of the others closest together. Empty when both have the same
/// events and the same major peaks.
std::vector<ContactChange> changes_between(const solver::CaseResult& coarser,
                                           const solver::CaseResult& finer);

/// "a restitution of 5.97 us, from 187.58 to 193.55 us (V_n grazes 0)".
std::string described(const ContactChange& change);

/// "restitution", "stick", ...
const char* name_of(ContactChange::Kind kind);

/// Given two ascending lists of times whose lengths differ by an even number: the first index of
/// each pair of neighbours to leave out of `longer` so that the sum of |differences| to `shorter`
/// is least.
std::vector<std::size_t> lone_pairs(const std::vector<double>& longer,
                                    const std::vector<double>& shorter);

/// A scalar that a contact gives.
struct Output {
  std::string name;  ///< with its unit, as results have it; `major_peak_2_N` is the second one
  double value;
  /// Largest force, duration, speed at touch, ...: what errors are small against. Digits below 1e-9
  /// of it are rounding.
  double scale;
  /// States up to the instant that makes the value, ripples merged. Values of two levels are the
  /// same quantity when this is the same.
  std::string mode;
};

/// fn_peak, ft_peak, every major peak, duration, stick, slide, impulses, exit velocity and the
/// largest reactions (reaction_0_N at the pin, reaction_1_N at the first joint, ...).
std::vector<Output> outputs_of(const solver::CaseResult& result);

/// One output over the levels.
struct OutputConvergence {
  std::string name;
  double scale;  ///< as of the finest level's Output
  /// One a level, coarsest first; nothing where the mode differs from the finest's before.
  std::vector<std::optional<double>> values;
  /// Over the finest levels that have the value, without a gap.
  Extrapolation extrapolation;

  double finest() const { return *values.back(); }
};

/// One point over the levels.
struct PointConvergence {
  std::vector<OutputConvergence> outputs;
  std::vector<ContactChange> changes;  ///< from each level to the next
  /// Whether the finest three levels have one mode, ripples merged: outputs have a limit to be seen
  /// only then.
  bool has_one_mode = false;
};

/// Judges one point from its results, coarsest level first. `highest_order` is the order that
/// theory promises at most.
PointConvergence convergence_of(std::span<const solver::CaseResult> results, double highest_order);

/// |value - limit| / |limit|, where both are there; of a limit of 0, nothing.
std::optional<double> relative_error(const std::optional<double>& value, double limit);

/// One point refined in one way, judged.
struct Refinement {
  std::string what;  ///< "mesh" or "step"
  std::vector<SolvedLevel> levels;
  PointConvergence convergence;
};

/// Judges `levels`, coarsest first.
Refinement refinement_of(std::string what, std::vector<SolvedLevel> levels);

/// Whether every output is seen to approach a limit: one mode on the finest three levels, and
/// differences that fall or are below a thousandth of the output's scale.
bool converges(const Refinement& refinement);

/// The outputs over the levels for people: values, limit, order, error; what comes and goes; the
/// verdict.
void print_refinement(std::ostream& out, const Refinement& refinement);

/// Levels, outputs, changes and verdict as one JSON object.
nlohmann::ordered_json json_of(const Refinement& refinement);

/// "The fall, solved for 1e-05, changes outputs by ... % at most": between the first level of
/// `step` and the same contact on the fall of exact_fall_level().
std::string fall_sentence(const Refinement& step, const SolvedLevel& exact_fall);

/// The same as a JSON object.
nlohmann::ordered_json json_of_fall(const Refinement& step, const SolvedLevel& exact_fall);

}  // namespace oblique::client
