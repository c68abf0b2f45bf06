#include "worker/solver/chain/beam_tangent.h"

#include <cstddef>

namespace oblique::solver {
namespace {

/// Symmetric 2x2 block.
struct Block {
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
};

/// d2U / dc_a dc_b for a, b = 0, 1, 2.
using CoefficientTangent = std::array<std::array<Block, 3>, 3>;

CoefficientTangent coefficient_tangent(const GradientCoefficients<double>& g, double half_EA_length,
                                       double bending) {
  constexpr std::array<double, 5> abscissa{-GaussRule::outer_abscissa, -GaussRule::inner_abscissa,
                                           0.0, GaussRule::inner_abscissa,
                                           GaussRule::outer_abscissa};
  constexpr std::array<double, 5> weight{GaussRule::outer_weight, GaussRule::inner_weight,
                                         GaussRule::centre_weight, GaussRule::inner_weight,
                                         GaussRule::outer_weight};
  CoefficientTangent h{};
  for (std::size_t i = 0; i < abscissa.size(); ++i) {
    const std::array<double, 3> p{1.0, abscissa[i], legendre_p2(abscissa[i])};
    const double x = g.c[0].x + p[1] * g.c[1].x + p[2] * g.c[2].x;
    const double y = g.c[0].y + p[1] * g.c[1].y + p[2] * g.c[2].y;
    const double strain = 0.5 * (x * x + y * y - 1.0);
    const double w = half_EA_length * weight[i];
    // d/dr' (eps r') = r' r'ᵀ + eps 1.
    const Block d{w * (x * x + strain), w * x * y, w * (y * y + strain)};
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = a; b < 3; ++b) {
        h[a][b].xx += p[a] * p[b] * d.xx;
        h[a][b].xy += p[a] * p[b] * d.xy;
        h[a][b].yy += p[a] * p[b] * d.yy;
      }
    }
  }
  h[1][1].xx += 2.0 * bending;
  h[1][1].yy += 2.0 * bending;
  h[2][2].xx += 6.0 * bending;
  h[2][2].yy += 6.0 * bending;
  h[1][0] = h[0][1];
  h[2][0] = h[0][2];
  h[2][1] = h[1][2];
  return h;
}

}  // namespace

std::array<std::array<double, 4>, 3> gradient_map(double inverse_length) {
  return {{{-inverse_length, 0.0, inverse_length, 0.0},
           {0.0, -0.5, 0.0, 0.5},
           {inverse_length, 0.5, -inverse_length, 0.5}}};
}

ElementTangent elastic_tangent(const GradientCoefficients<double>& g, double inverse_length,
                               double half_EA_length, double bending) {
  const CoefficientTangent h = coefficient_tangent(g, half_EA_length, bending);
  const auto map = gradient_map(inverse_length);
  std::array<std::array<Block, 4>, 3> half{};  // h map
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t j = 0; j < 4; ++j) {
      for (std::size_t b = 0; b < 3; ++b) {
        half[a][j].xx += h[a][b].xx * map[b][j];
        half[a][j].xy += h[a][b].xy * map[b][j];
        half[a][j].yy += h[a][b].yy * map[b][j];
      }
    }
  }
  ElementTangent k{};
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      Block sum;
      for (std::size_t a = 0; a < 3; ++a) {
        sum.xx += map[a][i] * half[a][j].xx;
        sum.xy += map[a][i] * half[a][j].xy;
        sum.yy += map[a][i] * half[a][j].yy;
      }
      k[2 * i][2 * j] = sum.xx;
      k[2 * i][2 * j + 1] = sum.xy;
      k[2 * i + 1][2 * j] = sum.xy;
      k[2 * i + 1][2 * j + 1] = sum.yy;
    }
  }
  return k;
}

}  // namespace oblique::solver
