#include "worker/solver/chain/beam_tangent.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <random>

namespace oblique::solver {
namespace {

constexpr double kLength_m = 0.1;
constexpr double kHalfEALength = 0.5 * 3.7e7 * kLength_m;
constexpr double kBending = 2.0 * 1570.0 / kLength_m;

/// p_i, s_i, p_j, s_j, x before y.
using Nodes = std::array<double, 8>;

Nodes energy_gradient(const Nodes& q) {
  const auto at = [&q](std::size_t i) { return PlanarVector<double>{q[2 * i], q[2 * i + 1]}; };
  const auto f = elastic_gradient(
      gradient_coefficients(at(0), at(1), at(2), at(3), 1.0 / kLength_m), kHalfEALength, kBending);
  const auto map = gradient_map(1.0 / kLength_m);
  Nodes gradient{};
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t a = 0; a < 4; ++a) {
      gradient[2 * a] += map[k][a] * f.c[k].x;
      gradient[2 * a + 1] += map[k][a] * f.c[k].y;
    }
  }
  return gradient;
}

TEST(BeamTangent, IsTheDerivativeOfTheElasticForceAndSymmetric) {
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int sample = 0; sample < 50; ++sample) {
    Nodes q{};
    for (std::size_t i = 0; i < q.size(); ++i) {
      q[i] = uniform(generator) * (i % 4 < 2 ? kLength_m : 1.0);
    }
    const auto at = [&q](std::size_t i) { return PlanarVector<double>{q[2 * i], q[2 * i + 1]}; };
    const auto tangent =
        elastic_tangent(gradient_coefficients(at(0), at(1), at(2), at(3), 1.0 / kLength_m),
                        1.0 / kLength_m, kHalfEALength, kBending);
    double scale = 0.0;
    for (const auto& row : tangent) {
      for (const double entry : row) {
        scale = std::max(scale, std::abs(entry));
      }
    }
    for (std::size_t j = 0; j < q.size(); ++j) {
      const auto moved = [&](double h) {
        Nodes m = q;
        m[j] += h;
        return energy_gradient(m);
      };
      // The force is a cubic polynomial: five points differentiate it exactly.
      const double h = 0.01;
      const Nodes f_2 = moved(-2 * h);
      const Nodes f_1 = moved(-h);
      const Nodes f1 = moved(h);
      const Nodes f2 = moved(2 * h);
      for (std::size_t i = 0; i < q.size(); ++i) {
        const double derivative = (f_2[i] - f2[i] + 8.0 * (f1[i] - f_1[i])) / (12.0 * h);
        EXPECT_NEAR(tangent[i][j], derivative, 1e-11 * scale);
        EXPECT_NEAR(tangent[i][j], tangent[j][i], 1e-14 * scale);
      }
    }
  }
}

}  // namespace
}  // namespace oblique::solver
