#include "worker/solver/chain/elastic_kernel.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "worker/solver/chain/beam_element.h"

namespace oblique::solver {
namespace {

constexpr double kLength_m = 0.1;
constexpr double kHalfEALength = 0.5 * 3.7e7 * kLength_m;
constexpr double kBending = 2.0 * 1570.0 / kLength_m;

/// p_i, s_i, p_j, s_j.
using Nodes = std::array<PlanarVector<double>, 4>;

Nodes random_nodes(std::mt19937_64& generator) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Nodes nodes;
  for (std::size_t a = 0; a < 4; ++a) {
    const double scale = a % 2 == 0 ? kLength_m : 1.0;
    nodes[a] = {scale * uniform(generator), scale * uniform(generator)};
  }
  return nodes;
}

Nodes forces_by_gauss_points(const Nodes& nodes) {
  ElementCoordinates q;
  for (Eigen::Index a = 0; a < 4; ++a) {
    const auto& [x, y] = nodes[static_cast<std::size_t>(a)];
    q.col(a) << x, y;
  }
  const double inverse_length = 1.0 / kLength_m;
  const ElementCoordinates f =
      -elastic_gradient(gradient_coefficients(q, inverse_length), kHalfEALength, kBending) *
      gradient_map(inverse_length);
  return {{{f(0, 0), f(1, 0)}, {f(0, 1), f(1, 1)}, {f(0, 2), f(1, 2)}, {f(0, 3), f(1, 3)}}};
}

Nodes forces_in_closed_form(const Nodes& q) {
  const auto f =
      elastic_forces(q[0], q[1], q[2], q[3], elastic_constants(kLength_m, kHalfEALength, kBending));
  return {f.pull,
          {f.by_d.x - f.by_t.x, f.by_d.y - f.by_t.y},
          {-f.pull.x, -f.pull.y},
          {-f.by_d.x - f.by_t.x, -f.by_d.y - f.by_t.y}};
}

TEST(ElasticKernel, GivesTheForcesOfFiveGaussPoints) {
  std::mt19937_64 generator(7);
  for (int trial = 0; trial < 200; ++trial) {
    const Nodes q = random_nodes(generator);
    const Nodes expected = forces_by_gauss_points(q);
    const Nodes actual = forces_in_closed_form(q);
    for (std::size_t a = 0; a < 4; ++a) {
      // Strains are of order 10 here; forces on positions are larger by 1/l.
      const double scale = kHalfEALength * (a % 2 == 0 ? 1.0 / kLength_m : 1.0);
      EXPECT_NEAR(actual[a].x, expected[a].x, 1e-12 * scale) << "trial " << trial;
      EXPECT_NEAR(actual[a].y, expected[a].y, 1e-12 * scale) << "trial " << trial;
    }
  }
}

TEST(ElasticKernel, GivesNoForceToARigidlyMovedElement) {
  for (const double angle_rad : {0.0, 0.3, -2.0, 3.1}) {
    const PlanarVector<double> s{std::cos(angle_rad), std::sin(angle_rad)};
    const Nodes q{{{0.7, -1.1}, s, {0.7 + kLength_m * s.x, -1.1 + kLength_m * s.y}, s}};
    for (const auto& force : forces_in_closed_form(q)) {
      EXPECT_NEAR(force.x, 0.0, 1e-14 * kHalfEALength / kLength_m);
      EXPECT_NEAR(force.y, 0.0, 1e-14 * kHalfEALength / kLength_m);
    }
  }
}

}  // namespace
}  // namespace oblique::solver
