#include "worker/solver/reference/chain.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "tests/worker/solver/reference/chain_probe.h"
#include "worker/solver/model/errors.h"

namespace oblique::solver {
namespace {

ModelParameters chain_of(std::size_t links, int elements_per_link) {
  ModelParameters model = preset("paper");
  model.lengths_m.clear();
  for (std::size_t i = 0; i < links; ++i) {
    model.lengths_m.push_back(0.4 - 0.05 * static_cast<double>(i));
  }
  model.elements_per_link = elements_per_link;
  return model;
}

double length_m(const ModelParameters& model) {
  return std::accumulate(model.lengths_m.begin(), model.lengths_m.end(), 0.0);
}

/// Returns the coordinates of the straight chain, rotated about the pin.
Coordinates turned(const Chain& chain, double angle_rad) {
  Coordinates q = chain.at_rest().q;
  q.row(1) = std::sin(angle_rad) * q.row(0);
  q.row(0) *= std::cos(angle_rad);
  return q;
}

TEST(Chain, ElasticForceIsMinusTheGradientOfTheStrainEnergy) {
  std::mt19937_64 generator(2);
  for (const std::size_t links : {1U, 2U, 4U}) {
    const Chain chain(chain_of(links, 3));
    const ChainProbe probe(chain);
    for (int sample = 0; sample < 10; ++sample) {
      const Coordinates q = probe.random_coordinates(generator, 0.3);
      const ChainProbe::Pairs force = probe.elastic_force(q);
      for (Eigen::Index i = 2; i < q.size(); ++i) {
        const auto energy = [&](double h) {
          Coordinates moved = q;
          moved(i) += h;
          return chain.strain_energy_J(moved);
        };
        // The energy is a polynomial of degree 4, for which a difference of five points is exact.
        const double h = 0.05;
        const double gradient =
            ((energy(-2 * h) - energy(2 * h)) + 8 * (energy(h) - energy(-h))) / (12 * h);
        EXPECT_NEAR(force(i / 2 - 1, i % 2), -gradient, 1e-11 * force.norm());
      }
    }
  }
}

TEST(Chain, AccelerationsSolveTheEquationsOfMotion) {
  std::mt19937_64 generator(3);
  ModelParameters model = chain_of(3, 2);
  model.tip_mass_kg = 0.2;
  const Chain chain(model);
  const ChainProbe probe(chain);
  const Coordinates q = probe.random_coordinates(generator, 0.01);
  ChainProbe::Pairs force = probe.elastic_force(q) + probe.gravity();
  const Eigen::Index tip = chain.tip_row() - 1;
  force(tip, 0) += 300.0;
  force(tip, 1) += 5000.0;
  const ChainProbe::Pairs expected = probe.mass().llt().solve(force);
  const ChainProbe::Pairs accelerations = probe.accelerations(q, 300.0, 5000.0);
  EXPECT_LT((accelerations - expected).norm(), 1e-10 * expected.norm());
}

TEST(Chain, RigidRotationAboutThePinGivesNeitherForceNorEnergy) {
  const Chain chain(chain_of(3, 4));
  const ChainProbe probe(chain);
  for (const double angle_rad : {-1.5, -0.4, 0.9, 3.0}) {
    const Coordinates q = turned(chain, angle_rad);
    EXPECT_LT(chain.strain_energy_J(q), 1e-20);
    // For comparison: a strain of 1 gives a force of 3.7e7 N.
    EXPECT_LT(probe.elastic_force(q).cwiseAbs().maxCoeff(), 1e-5);
  }
}

TEST(Chain, JointsRotateFreely) {
  // The outer link is folded back onto the inner link, which has the same length. This stores no
  // energy.
  ModelParameters model = preset("paper");
  model.lengths_m = {0.4, 0.4};
  model.elements_per_link = 1;
  const Chain chain(model);
  Coordinates q = chain.at_rest().q;
  // The rows are: pin, slope, slope before the joint, joint, slope after the joint, tip, slope.
  ASSERT_EQ(chain.rows(), 7);
  q.rightCols<3>() << 0.0, 0.4, 0.0, 1.0, 0.4, 1.0;
  EXPECT_LT(chain.strain_energy_J(q), 1e-20);
  // A rotated slope before the joint bends the inner link. This stores energy.
  q.col(2) << 0.0, 1.0;
  EXPECT_GT(chain.strain_energy_J(q), 1.0);
}

TEST(Chain, WeighsTheSumOfItsLinksAndItsTip) {
  ModelParameters model = chain_of(4, 3);
  model.tip_mass_kg = 0.3;
  const Chain chain(model);
  Coordinates lifted = Coordinates::Zero(2, chain.rows());
  for (const Eigen::Index row : position_rows(model)) {
    lifted(1, row) = 1.0;
  }
  const double mass_kg = model.rho_kg_m3 * model.A_m2 * length_m(model) + model.tip_mass_kg;
  EXPECT_NEAR(chain.gravity_energy_J(lifted), mass_kg * model.g_m_s2, 1e-12 * mass_kg);
  EXPECT_LT(chain.gravity_energy_J(-lifted), 0.0) << "gravity pulls downwards";
}

TEST(Chain, RotationAboutThePinHasTheMomentOfInertiaOfARod) {
  ModelParameters model = chain_of(3, 2);
  model.tip_mass_kg = 0.3;
  const Chain chain(model);
  const double L = length_m(model);
  // At 2 rad/s, velocities are twice the coordinates rotated by a right angle, slopes included.
  const Coordinates v = 2.0 * turned(chain, 0.5 * M_PI);
  const double inertia = model.rho_kg_m3 * model.A_m2 * L * L * L / 3.0 + model.tip_mass_kg * L * L;
  EXPECT_NEAR(chain.kinetic_energy_J(v), 0.5 * inertia * 4.0, 1e-12 * inertia);
}

TEST(Chain, InFreeFallReactionsAreZero) {
  ModelParameters model = chain_of(3, 2);
  model.tip_mass_kg = 0.1;
  const Chain chain(model);
  const Coordinates q = turned(chain, -0.5 * M_PI);
  const Coordinates fall_freely = [&] {
    Coordinates a = Coordinates::Zero(2, q.cols());
    for (const Eigen::Index row : position_rows(model)) {
      a(1, row) = -model.g_m_s2;
    }
    return a;
  }();
  for (std::size_t link = 0; link < chain.links(); ++link) {
    EXPECT_LT(chain.inner_end_force(link, q, fall_freely).norm(), 1e-6);
  }
}

TEST(ChainFrequency, IsTheLargestEigenvalueOfTheNumericalJacobian) {
  for (const std::size_t links : {1U, 2U, 3U}) {
    for (const int n : {1, 2, 3}) {
      for (const double stiffness_N_m : {0.0, 2.7e7, 3e9}) {
        const Chain chain(chain_of(links, n));
        const ChainProbe probe(chain);
        const Eigen::Index size = 2 * probe.mass().rows();
        Eigen::MatrixXd jacobian(size, size);
        for (Eigen::Index j = 0; j < size; ++j) {
          const auto moved = [&](double h) -> ChainProbe::Pairs {
            ChainState state = chain.at_rest();
            const TipState start = chain.tip(state);
            state.q(j + 2) += h;
            const TipState tip = chain.tip(state);
            return probe.accelerations(state.q, -stiffness_N_m * (tip.x_m - start.x_m),
                                       -stiffness_N_m * (tip.y_m - start.y_m));
          };
          const ChainProbe::Pairs column = (moved(1e-4) - moved(-1e-4)) / 2e-4;
          jacobian.col(j) = Eigen::Map<const Eigen::VectorXd>(column.data(), size);
        }
        const double dense = std::sqrt(-jacobian.eigenvalues().real().minCoeff());
        // The difference quotient of a cubic polynomial has an error of h^2 = 1e-8.
        EXPECT_NEAR(chain.highest_frequency_rad_s(stiffness_N_m), dense, 1e-6 * dense)
            << links << " links, n = " << n << ", k = " << stiffness_N_m;
      }
    }
  }
}

TEST(ChainFrequency, GivesTheKnownStabilityLimitsOfVerlet) {
  // The limit of the step is 2/omega. Known values are for the cross-section printed in the paper.
  struct Known {
    int elements_per_link;
    double dt_s;
    double digits_s;
  };
  for (const Known& known : {Known{4, 3.80e-6, 0.005e-6}, Known{8, 1.6e-6, 0.05e-6},
                             Known{16, 5.5e-7, 0.05e-7}, Known{32, 1.55e-7, 0.005e-7}}) {
    ModelParameters model = preset("printed");
    model.elements_per_link = known.elements_per_link;
    EXPECT_NEAR(2.0 / Chain(model).highest_frequency_rad_s(0.0), known.dt_s, known.digits_s);
  }
}

TEST(Chain, TheEffectiveTipMassIsThePointMassAndAPartOfTheLastElement) {
  ModelParameters model = preset("paper");
  const double bare_kg = Chain(model).tip_inertia_kg();
  const double element_kg = model.rho_kg_m3 * model.A_m2 * model.lengths_m.back() / 4.0;
  EXPECT_NEAR(bare_kg, element_kg / 16.0, 0.02 * element_kg);
  model.tip_mass_kg = 0.3;
  EXPECT_NEAR(Chain(model).tip_inertia_kg(), bare_kg + 0.3, 1e-12);
}

}  // namespace
}  // namespace oblique::solver
