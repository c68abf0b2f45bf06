#include "worker/solver/chain/beam_tangent.h"

#include <gtest/gtest.h>

#include <random>

namespace oblique::solver {
namespace {

constexpr double kLength_m = 0.1;
constexpr double kHalfEALength = 0.5 * 3.7e7 * kLength_m;
constexpr double kBending = 2.0 * 1570.0 / kLength_m;

ElementCoordinates energy_gradient(const ElementCoordinates& q) {
  return elastic_gradient(gradient_coefficients(q, 1.0 / kLength_m), kHalfEALength, kBending) *
         gradient_map(1.0 / kLength_m);
}

TEST(BeamTangent, IsTheDerivativeOfTheElasticForceAndSymmetric) {
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int sample = 0; sample < 50; ++sample) {
    ElementCoordinates q = ElementCoordinates::NullaryExpr([&] { return uniform(generator); });
    q.col(0) *= kLength_m;
    q.col(2) *= kLength_m;
    const ElementTangent tangent =
        elastic_tangent(gradient_coefficients(q, 1.0 / kLength_m), gradient_map(1.0 / kLength_m),
                        kHalfEALength, kBending);
    const double scale = tangent.cwiseAbs().maxCoeff();
    EXPECT_LT((tangent - tangent.transpose()).cwiseAbs().maxCoeff(), 1e-14 * scale);
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      const auto moved = [&](double h) {
        ElementCoordinates m = q;
        m(j) += h;
        return energy_gradient(m);
      };
      // The force is a cubic polynomial: five points differentiate it exactly.
      const double h = 0.01;
      const ElementCoordinates derivative =
          (moved(-2 * h) - moved(2 * h) + 8.0 * (moved(h) - moved(-h))) / (12.0 * h);
      EXPECT_LT((tangent.col(j) - derivative.reshaped()).cwiseAbs().maxCoeff(), 1e-11 * scale);
    }
  }
}

TEST(BeamTangent, AMatrixOfOneDirectionActsOnBothAlike) {
  const Eigen::Matrix4d matrix = Eigen::Matrix4d::Random();
  const ElementCoordinates q = ElementCoordinates::Random();
  const ElementCoordinates expected = q * matrix.transpose();
  const Eigen::Vector<double, 8> product = in_both_directions(matrix) * q.reshaped();
  EXPECT_LT((product - expected.reshaped()).norm(), 1e-15);
}

}  // namespace
}  // namespace oblique::solver
