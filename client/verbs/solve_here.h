#pragma once

#include "worker/solver/model/case_result.h"
#include "worker/solver/model/trace.h"
#include "worker/solver/solve.h"

namespace oblique::client {

/// A point to solve in this process.
struct PointToSolve {
  double H_m = 0.0;
  double mu = 0.0;
  double e_star = 0.0;
  bool errors = false;  ///< estimate errors too
};

/// Solves the point and gives its instants to `tracing`. What takes long is told on standard error,
/// where that is a terminal and not `is_terminal_taken` by what is printed. Errors that cannot be
/// estimated are absent, which is told too. Throws what Finger::solve throws.
solver::CaseResult solve_here(const solver::Finger& finger, const PointToSolve& point,
                              const solver::Tracing& tracing, bool is_terminal_taken);

}  // namespace oblique::client
