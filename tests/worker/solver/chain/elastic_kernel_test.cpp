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

/// dU/dq from dU/dc, by c0 = (p_j - p_i)/l, c1 = (s_j - s_i)/2, c2 = (s_i + s_j)/2 - c0.
Nodes forces_by_gauss_points(const Nodes& q) {
  const auto f = elastic_gradient(gradient_coefficients(q[0], q[1], q[2], q[3], 1.0 / kLength_m),
                                  kHalfEALength, kBending);
  const auto force = [&f](double by_c0, double by_c1, double by_c2) {
    return PlanarVector<double>{-by_c0 * f.c[0].x - by_c1 * f.c[1].x - by_c2 * f.c[2].x,
                                -by_c0 * f.c[0].y - by_c1 * f.c[1].y - by_c2 * f.c[2].y};
  };
  const double a = 1.0 / kLength_m;
  return {force(-a, 0.0, a), force(0.0, -0.5, 0.5), force(a, 0.0, -a), force(0.0, 0.5, 0.5)};
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
