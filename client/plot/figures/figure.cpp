#include "client/plot/figures/figure.h"

#include <cmath>

namespace oblique::client::plot {
namespace {

double middle_of(double a, double b, bool is_logarithmic) {
  return is_logarithmic ? std::sqrt(a) * std::sqrt(b) : 0.5 * (a + b);
}

}  // namespace

Colour shade_of(const Colours& colours, double share) {
  return shade(shade_number(share * (colours.has_plate ? kDarkShare : 1.0)));
}

void say_empty(Figure& figure, const std::string& why) {
  figure.is_empty = true;
  figure.notes.push_back("Nothing to draw: " + why + ".");
}

bool has_colour_scale(const Figure& figure) {
  return figure.colours && !figure.is_empty;
}

KindGrid kind_grid_of(const Cells& cells) {
  KindGrid grid{cells.columns(), cells.rows(), std::vector<int>(cells.values.size(), -1)};
  for (std::size_t i = 0; i < grid.kinds.size(); ++i) {
    if (cells.states[i] == CellState::kSolved) {
      grid.kinds[i] = static_cast<int>(cells.values[i]);
    }
  }
  return grid;
}

Gaps gaps_of(const Cells& cells) {
  Gaps gaps;
  for (const CellState state : cells.states) {
    gaps.no_result += state == CellState::kNoResult ? 1U : 0U;
    gaps.filtered += state == CellState::kFiltered ? 1U : 0U;
    gaps.failed += state == CellState::kFailed ? 1U : 0U;
    gaps.no_value += state == CellState::kNoValue ? 1U : 0U;
  }
  return gaps;
}

std::vector<double> middles_of(const std::vector<double>& edges, bool is_logarithmic) {
  std::vector<double> middles;
  for (std::size_t i = 1; i < edges.size(); ++i) {
    middles.push_back(middle_of(edges[i - 1], edges[i], is_logarithmic));
  }
  return middles;
}

std::vector<double> edges_between(const std::vector<double>& values, bool is_logarithmic) {
  if (values.empty()) {
    return {};
  }
  const std::size_t last = values.size() - 1;
  if (last == 0) {
    const double v = values.front();
    const double half = v == 0.0 ? 0.5 : 0.1 * std::abs(v);
    return is_logarithmic ? std::vector<double>{v / 1.25, v * 1.25}
                          : std::vector<double>{v - half, v + half};
  }
  // The outer cells reach as far outwards as inwards.
  const auto mirrored = [is_logarithmic](double end, double inner) {
    return is_logarithmic ? end / inner * end : end + (end - inner);
  };
  std::vector<double> edges(values.size() + 1);
  for (std::size_t i = 1; i <= last; ++i) {
    edges[i] = middle_of(values[i - 1], values[i], is_logarithmic);
  }
  edges.front() = mirrored(values.front(), edges[1]);
  edges.back() = mirrored(values.back(), edges[last]);
  return edges;
}

}  // namespace oblique::client::plot
