#pragma once

#include <cstddef>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "client/convergence/convergence.h"
#include "client/convergence/levels.h"

namespace oblique::client {

/// One point refined in one way, judged.
struct Refinement {
  std::string what;  ///< "mesh" or "step"
  std::vector<SolvedLevel> levels;
  PointConvergence convergence;
  std::size_t point = 0;  ///< which of the levels' results

  const solver::CaseResult& result(std::size_t level) const { return levels[level].results[point]; }
};

/// Judges point number `point` of `levels`.
Refinement refinement_of(std::string what, const std::vector<SolvedLevel>& levels,
                         std::size_t point);

/// Differences that do not fall count as settled below this part of the output's scale: a fine mesh
/// carries ever faster vibrations, which leave outputs wavering at about this level.
inline constexpr double kSettled = 1e-3;

/// Whether every output is seen to approach a limit: one mode on the finest three levels, and
/// differences that fall or are below kSettled.
bool converges(const Refinement& refinement);

/// The outputs over the levels for people: values, limit, order, error; what comes and goes; the
/// verdict.
void print_refinement(std::ostream& out, const Refinement& refinement);

/// "The fall, solved for 1e-05, changes outputs by ... % at most": between the first level of
/// `step` and the same contact on the fall of exact_fall_level().
std::string fall_sentence(const Refinement& step, const SolvedLevel& exact_fall);

/// The same as a JSON object.
nlohmann::ordered_json json_of_fall(const Refinement& step, const SolvedLevel& exact_fall);

/// The mode on every level, ripples merged.
void print_modes(std::ostream& out, const Refinement& refinement);

/// Levels, outputs, changes and verdict as one JSON object.
nlohmann::ordered_json json_of(const Refinement& refinement);

/// Differences of outputs from their limits on each level [%].
void print_errors(std::ostream& out, const Refinement& refinement);

}  // namespace oblique::client
