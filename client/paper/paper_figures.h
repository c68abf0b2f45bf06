#pragma once

#include <string>
#include <vector>

#include "client/paper/paper_comparison.h"
#include "client/plot/figure.h"
#include "client/plot/point_figure.h"
#include "worker/solver/solve.h"

namespace oblique::client {

/// A published case with our time histories of it.
struct PaperCase {
  PublishedCase published;
  plot::PointHistory history;  ///< with its result
  std::string name;            ///< what tells it from others of its group: "H = 0.96 m"
};

/// Cases that differ in one parameter.
struct PaperGroup {
  std::string title;  ///< "drop H (\u03bc = 0.4, e* = 1)"
  std::vector<PaperCase> cases;
};

/// The paper's groups in its order: over H, over e*, over small and over large mu.
using PaperGroups = std::vector<PaperGroup>;

/// Solves each case once. Throws solver::SolveError when one cannot be solved, std::runtime_error
/// when the table lacks one.
PaperGroups solved_groups(const PublishedTable& table, const solver::Finger& finger);

/// One of the paper's figures as we draw it.
struct PaperFigure {
  std::string name;  ///< of its file, without ending: "fig4_forces"
  plot::Figure figure;
};

/// Figs. 3 to 7, each curve solved by us and published numbers as diamonds. The paper publishes no
/// instants of peaks: diamonds are at ours. Ends of phases are sums of published durations.
std::vector<PaperFigure> paper_figures(const PaperGroups& groups);

}  // namespace oblique::client
