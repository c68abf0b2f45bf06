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

/// One level of a refinement: a model and its name, such as "n = 8".
struct Level {
  std::string name;
  solver::ModelParameters model;
};

/// Returns meshes from `coarsest` to `finest` elements per link, doubled each time. The explicit
/// integrator chooses its steps on each mesh; the steps of generalized-alpha do not depend on the
/// mesh. Throws InputError unless finest is coarsest times 4, 8, 16, ...
std::vector<Level> mesh_levels(const solver::ModelParameters& model, int coarsest, int finest);

/// Returns models in which the steps of contact and fall are halved each time. The first step is
/// the shortest that the model takes in the contact at `e_star`. If the tolerance controls the
/// steps of the fall, all levels share one fall; see exact_fall_level().
std::vector<Level> step_levels(const solver::ModelParameters& model, double e_star, int halvings);

/// Returns the same contact as `level` after a fall with a tenth of the tolerance, which shows the
/// error of the fall. Returns nothing if the fall has a fixed step.
std::optional<Level> exact_fall_level(const Level& level);

struct ContactPoint {
  double H_m;
  double mu;
  double e_star;
};

struct SolvedLevel {
  Level level;
  solver::CaseResult result;
  double wall_s = 0.0;  ///< wall time of solving fall and contact
};

/// Solves `point` on all levels in parallel. Levels with the same fall share it. `line` shows
/// progress. `after_each` is called on the thread of each level when it ends, one call at a time.
/// Throws InputError and SolveError as the solver does.
std::vector<SolvedLevel> solve_levels(const std::vector<Level>& levels, const ContactPoint& point,
                                      StatusLine& line,
                                      const std::function<void(const SolvedLevel&)>& after_each);

/// Behaviour of a sequence of values for meshes or steps that are halved each time.
enum class Trend {
  kTooFew,       ///< fewer than three values
  kRounding,     ///< the last two values differ only by rounding
  kMonotone,     ///< the last two differences have the same sign, and the last is smaller
  kOscillating,  ///< the last two differences have different signs, and the last is smaller
  kUnsettled,    ///< the last difference is not much smaller: no limit is visible
};

/// Richardson extrapolation of a sequence v_1, v_2, ..., v_m, where d_1 = v_{m-1} - v_{m-2} and d_2
/// = v_m - v_{m-1}. Monotone values have order p = log2 |d_1 / d_2|, limit = v_m + d_2 / (2^p - 1)
/// and error = |limit - v_m|. If p exceeds the theoretical order P, the last difference is small by
/// chance: the error then uses |d_1| 2^-P instead of |d_2|, and p = P. Oscillating values are not
/// extrapolated: limit = v_m, error = max(|d_2|, |d_1| 2^-P). For unsettled values, including those
/// of an order below kLeastOrder, the error is the larger difference, which is not a bound.
inline constexpr double kLeastOrder = 0.4;
struct Extrapolation {
  Trend trend = Trend::kTooFew;
  double limit = 0.0;
  std::optional<double> order;  ///< observed order; only for monotone values
  std::optional<double> error;  ///< estimated error of the last value; needs two values
};

/// Extrapolates `values`, which are not empty and begin with the coarsest level. `highest_order` is
/// P. Differences below `resolution`, in the unit of the values, count as rounding.
Extrapolation extrapolate(std::span<const double> values, double highest_order, double resolution);

/// A part of a contact that is missing on another level. The cause is a grazing event, for example
/// that V_n just reaches zero: small errors then decide whether its sign changes.
struct ContactChange {
  enum class Kind {
    kCompression,  ///< an additional compression: V_n changes its sign twice more
    kRestitution,  ///< an additional restitution: V_n changes its sign twice more
    kStick,        ///< P comes to rest
    kSlip,         ///< P slides between two sticks
    kRipple,       ///< not an event: a peak close to the limit between ripple and major peak
  };
  Kind kind;
  double t0_s;  ///< from touch
  double t1_s;
  bool in_finer;                ///< false: only the coarser solution has the part
  std::size_t finer_level = 0;  ///< index of the finer level
};

/// Returns the differences between the contacts on two levels: first additional compressions and
/// restitutions, then the others, each in order of time. Events of one kind are matched in order.
/// If one level has more events, the match is chosen for which the times agree best. Returns
/// nothing if both levels have the same events and major peaks.
std::vector<ContactChange> changes_between(const solver::CaseResult& coarser,
                                           const solver::CaseResult& finer);

/// Describes a change, as "a restitution of 5.97 us, from 187.58 to 193.55 us (V_n grazes 0)".
std::string described(const ContactChange& change);

/// Returns "restitution", "stick" and so on.
const char* name_of(ContactChange::Kind kind);

/// Matches two lists of ascending times whose lengths differ by an even number. The surplus of
/// `longer` is left out in pairs of neighbours so that the sum of |differences| to `shorter` is
/// minimal. Returns the first index of each pair. Throws std::invalid_argument for other lengths.
std::vector<std::size_t> lone_pairs(const std::vector<double>& longer,
                                    const std::vector<double>& shorter);

/// A scalar output of a contact.
struct Output {
  std::string name;  ///< name with the unit; `major_peak_2_N` is the second peak
  double value;
  /// Scale for errors: the largest force, the duration, the speed at touch, and so on. Changes
  /// below 1e-9 of the scale count as rounding.
  double scale;
  /// States up to the time of the value, with ripples merged. The values of two levels are the same
  /// quantity only if these states are equal.
  std::string mode;
};

/// Returns peak forces, major peaks, duration, stick, slide, impulses, exit velocity and largest
/// reactions (reaction_0_N at the pin, reaction_1_N at the first joint, and so on).
std::vector<Output> outputs_of(const solver::CaseResult& result);

struct OutputConvergence {
  std::string name;
  double scale;  ///< Output::scale on the finest level
  /// One value per level, coarsest first; nothing for a level whose states before the value differ
  /// from those of the finest level.
  std::vector<std::optional<double>> values;
  /// Extrapolation of the values of the levels after the last level without a value.
  Extrapolation extrapolation;

  double finest() const { return *values.back(); }
};

struct PointConvergence {
  std::vector<OutputConvergence> outputs;
  std::vector<ContactChange> changes;  ///< differences between neighbouring levels
  /// Whether the finest three levels have the same mode after ripples are merged. If not, no limit
  /// is visible.
  bool has_one_mode = false;
};

/// Compares the results of one point on several levels, coarsest first. `highest_order` is the
/// theoretical order.
PointConvergence convergence_of(std::span<const solver::CaseResult> results, double highest_order);

/// Returns |value - limit| / |limit|; nothing if either is missing or the limit is 0.
std::optional<double> relative_error(const std::optional<double>& value, double limit);

struct Refinement {
  std::string what;  ///< "mesh" or "step"
  std::vector<SolvedLevel> levels;
  PointConvergence convergence;
};

/// Compares `levels`, coarsest first.
Refinement refinement_of(std::string what, std::vector<SolvedLevel> levels);

/// Whether all outputs approach a limit: the finest three levels have the same mode, and the
/// differences decrease or are below a thousandth of the output's scale.
bool converges(const Refinement& refinement);

/// Prints a table of the outputs, the events that only some levels have, and the verdict.
void print_refinement(std::ostream& out, const Refinement& refinement);

/// Returns levels, outputs, changes and verdict as one JSON object.
nlohmann::ordered_json json_of(const Refinement& refinement);

/// Compares the first level of `step` with the same contact after a fall with a smaller tolerance.
/// Returns "A fall solved for 1e-06 instead of 1e-05 changes outputs by at most ... %".
std::string fall_sentence(const Refinement& step, const SolvedLevel& exact_fall);

/// Returns the comparison of fall_sentence() as a JSON object.
nlohmann::ordered_json json_of_fall(const Refinement& step, const SolvedLevel& exact_fall);

}  // namespace oblique::client
