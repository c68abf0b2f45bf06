#include "client/verbs/solve_here.h"

#include <exception>
#include <iostream>

#include <spdlog/fmt/fmt.h>

#include "client/output/work_line.h"
#include "client/verbs/tip_reach.h"
#include "worker/solver/estimate.h"

namespace oblique::client {
namespace {

solver::CaseResult solved(const solver::Finger& finger, const PointToSolve& point,
                          const solver::Tracing& tracing, bool is_terminal_taken) {
  WorkLineSettings settings;
  settings.on_terminal = settings.on_terminal && !is_terminal_taken;
  WorkLine line(std::cerr, settings);
  static_cast<void>(largest_drop_m(finger, line));
  const auto touching =
      line.begin(fmt::format("on {} elements a link: contact", finger.model().elements_per_link));
  return finger.solve(point.H_m, point.mu, point.e_star, tracing);
}

/// Nothing when there is no coarser mesh, or the solution on it has no answer.
solver::ErrorEstimate errors_of(const solver::ModelParameters& model, const PointToSolve& point,
                                const solver::CaseResult& result, bool is_terminal_taken) {
  const solver::ModelParameters companion = solver::companion_model(model);
  if (companion.elements_per_link >= model.elements_per_link) {
    std::cerr << "Errors cannot be estimated: there is no coarser mesh than one element a link.\n";
    return {};
  }
  try {
    return solver::estimated_errors(
        model, result, solved(solver::Finger(companion), point, {}, is_terminal_taken));
  } catch (const std::exception& error) {
    std::cerr << "Errors cannot be estimated: on half the mesh, " << error.what() << '\n';
    return {};
  }
}

}  // namespace

solver::CaseResult solve_here(const solver::Finger& finger, const PointToSolve& point,
                              const solver::Tracing& tracing, bool is_terminal_taken) {
  auto result = solved(finger, point, tracing, is_terminal_taken);
  if (point.errors) {
    result.errors = errors_of(finger.model(), point, result, is_terminal_taken);
  }
  return result;
}

}  // namespace oblique::client
