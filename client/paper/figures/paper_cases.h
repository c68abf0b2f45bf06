#pragma once

#include <string>
#include <vector>

#include "client/paper/published_table.h"
#include "client/plot/point_figure.h"
#include "worker/solver/solve.h"

namespace oblique::client {

/// A published case with our time histories of it.
struct PaperCase {
  PublishedCase published;
  plot::PointHistory history;  ///< with its result
};

/// Cases that differ in one parameter.
struct PaperGroup {
  enum class Key { kH, kMu, kE };
  Key key = Key::kH;
  std::string title;  ///< "drop H, at \u03bc = 0.4, e* = 1"
  std::vector<PaperCase> cases;
};

/// The paper's groups in its order: over H, over e*, over small and over large mu.
struct PaperGroups {
  PaperGroup over_H;
  PaperGroup over_e;
  PaperGroup over_small_mu;
  PaperGroup over_large_mu;
};

/// Solves each case once. Throws solver::SolveError when one cannot be solved, std::runtime_error
/// when the table lacks one.
PaperGroups solved_groups(const PublishedTable& table, const solver::Finger& finger);

/// "H = 0.96 m": what tells the case from others of its group.
std::string name_in_group(const PaperCase& one, PaperGroup::Key key);

}  // namespace oblique::client
