#pragma once

#include <string>
#include <vector>

#include "client/paper/figures/paper_cases.h"
#include "client/plot/figure.h"

namespace oblique::client {

/// One of the paper's figures as we draw it.
struct PaperFigure {
  std::string name;  ///< of its file, without ending: "fig4_forces"
  plot::Figure figure;
};

/// Figs. 3 to 7, each curve solved by us and published numbers as diamonds. The paper publishes no
/// instants of peaks: diamonds are at ours. Ends of phases are sums of published durations.
std::vector<PaperFigure> paper_figures(const PaperGroups& groups);

}  // namespace oblique::client
