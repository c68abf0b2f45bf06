#pragma once

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
