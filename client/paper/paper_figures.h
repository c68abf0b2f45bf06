#pragma once

#include <string>
#include <vector>

#include "client/paper/paper_comparison.h"
#include "client/plot/figure.h"
#include "client/plot/point_figure.h"
#include "worker/solver/solve.h"

namespace oblique::client {

/// A published case with its time histories, which this program solves.
struct PaperCase {
  PublishedCase published;
  plot::PointHistory history;  ///< including its result
  std::string name;            ///< label within its group: "H = 0.96 m"
};

/// Published cases that differ in one parameter.
struct PaperGroup {
  std::string title;  ///< "drop H (\u03bc = 0.4, e* = 1)"
  std::vector<PaperCase> cases;
};

/// The groups in the order of the paper. They vary H, e*, mu among small values, and mu among large
/// values.
using PaperGroups = std::vector<PaperGroup>;

/// Solves each case once. Throws solver::SolveError if a case cannot be solved, and
/// std::runtime_error if the table lacks a case.
PaperGroups solved_groups(const PublishedTable& table, const solver::Finger& finger);

/// One of the paper's figures, drawn with our results.
struct PaperFigure {
  std::string name;  ///< file name without ending: "fig4_forces"
  plot::Figure figure;
};

/// Returns Figs. 3 to 7 with our solutions as curves and published numbers as diamonds. The paper
/// does not publish the times of peaks, so the diamonds are at the times of our peaks. Ends of
/// phases are sums of published durations.
std::vector<PaperFigure> paper_figures(const PaperGroups& groups);

}  // namespace oblique::client
