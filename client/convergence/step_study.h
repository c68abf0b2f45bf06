#pragma once

#include <cstddef>
#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "client/convergence/levels.h"
#include "client/output/printer.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// What steps leave in the contacts of one model, against steps six times shorter than the chosen
/// ones on the same mesh, from the same fall. Largest errors over the points of one mode.
struct StepErrors {
  double factor;           ///< of the chosen steps
  double step_s = 0.0;     ///< in compression
  double of_limit = 0.0;   ///< of the longest stable step
  double peaks = 0.0;      ///< of major peaks of F_n, over the contact's largest
  double each_peak = 0.0;  ///< the same, each over itself
  double duration = 0.0;   ///< relative
  double slide = 0.0;      ///< relative
  double stick_s = 0.0;
  double exit_m_s = 0.0;        ///< of either exit velocity
  std::size_t late_sticks = 0;  ///< points whose stick errs by more than kStickBound_s
  std::size_t grazing = 0;      ///< points that have another mode at the other step; not judged
};

/// What a default tolerance should leave in the time of stick at most [s].
inline constexpr double kStickBound_s = 5e-9;

/// A model of the study with the points and the steps that it is judged by.
struct StepStudyCase {
  std::string name;  ///< as "k = 1e+08"
  solver::ModelParameters model;
  std::size_t points;
  double least_e;
  double largest_e;
  std::vector<double> factors;
};

struct StepStudyResult {
  std::string name;
  std::size_t points;
  std::vector<StepErrors> steps;  ///< one a factor
};

/// Meshes, contact stiffnesses, restitution, tip masses and lengths around `model`.
std::vector<StepStudyCase> step_study_cases(const solver::ModelParameters& model);

/// Points spread evenly, the same each time: H from 0.17 to 0.97 of the largest drop, mu from 0 to
/// 2, e* from least_e to largest_e.
std::vector<ContactPoint> step_study_points(const StepStudyCase& of, double largest_drop_m);

/// Solves the cases side by side on the cores of this machine, the last first; results come in the
/// order of `cases`. `after_each` is called as each ends, from its thread. Throws what the solver
/// throws.
std::vector<StepStudyResult> step_study(
    const std::vector<StepStudyCase>& cases,
    const std::function<void(const StepStudyResult&)>& after_each);

/// One row for each case and factor.
void print_step_study(std::ostream& out, const std::vector<StepStudyResult>& results,
                      Format format);

}  // namespace oblique::client
