#include "tests/validation/clamped_beam.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "worker/solver/reference/banded.h"
#include "worker/solver/reference/beam_element.h"

namespace oblique::validation {
namespace {

constexpr std::size_t kBandwidth = 7;
constexpr std::size_t kClamped = 4;  ///< coordinates of the first node
constexpr double kConverged = 1e-12;
constexpr int kMostIterations = 50;

}  // namespace

ClampedBeam::ClampedBeam(const Properties& properties)
    : properties_(properties),
      element_length_m_(properties.length_m / properties.elements),
      q_(4 * (static_cast<std::size_t>(properties.elements) + 1), 0.0) {
  for (std::size_t i = 0; i < q_.size(); i += 4) {
    q_[i] = element_length_m_ * static_cast<double>(i / 4);
    q_[i + 2] = 1.0;
  }
}

void ClampedBeam::load_to(const TipLoad& load, int increments) {
  const TipLoad from = load_;
  for (int i = 1; i <= increments; ++i) {
    const double part = static_cast<double>(i) / increments;
    equilibrate({from.force_y_N + part * (load.force_y_N - from.force_y_N),
                 from.moment_N_m + part * (load.moment_N_m - from.moment_N_m)});
  }
  load_ = load;
}

void ClampedBeam::equilibrate(const TipLoad& load) {
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    if (newton_step(load) < kConverged) {
      return;
    }
  }
  throw std::runtime_error("the clamped beam found no equilibrium");
}

double ClampedBeam::newton_step(const TipLoad& load) {
  solver::BandedLu<kBandwidth> matrix;
  matrix.set_zero(q_.size() - kClamped);
  std::vector<double> residual(q_.size() - kClamped, 0.0);
  const auto constants =
      solver::element_constants(element_length_m_, properties_.EA_N, properties_.EI_N_m2, 0.0);
  for (std::size_t first = 0; first + 4 < q_.size(); first += 4) {
    const Eigen::Map<const solver::ElementCoordinates> q(&q_[first]);
    const solver::ElementCoordinates force = solver::elastic_gradient(q, constants);
    const auto tangent = solver::elastic_tangent(q, constants);
    for (std::size_t a = 0; a < 8; ++a) {
      if (first + a < kClamped) {
        continue;
      }
      residual[first + a - kClamped] += force.data()[a];
      for (std::size_t b = 0; b < 8; ++b) {
        if (first + b >= kClamped) {
          matrix.add(first + a - kClamped, first + b - kClamped,
                     tangent(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)));
        }
      }
    }
  }
  const std::size_t tip = residual.size() - 4;
  residual[tip + 1] -= load.force_y_N;
  // A moment works on the slope's angle: Q = M (-s_y, s_x)/|s|^2.
  const double x = q_[q_.size() - 2];
  const double y = q_[q_.size() - 1];
  const double s = x * x + y * y;
  const double m = load.moment_N_m / s;
  residual[tip + 2] += m * y;
  residual[tip + 3] -= m * x;
  matrix.add(tip + 2, tip + 2, -2.0 * m * x * y / s);
  matrix.add(tip + 2, tip + 3, m - 2.0 * m * y * y / s);
  matrix.add(tip + 3, tip + 2, -m + 2.0 * m * x * x / s);
  matrix.add(tip + 3, tip + 3, 2.0 * m * x * y / s);
  if (!matrix.factor()) {
    throw std::runtime_error("the tangent of the clamped beam is singular");
  }
  matrix.solve(residual);
  double largest = 0.0;
  for (std::size_t i = 0; i < residual.size(); ++i) {
    q_[i + kClamped] -= residual[i];
    const double scale = i % 4 < 2 ? element_length_m_ : 1.0;
    largest = std::max(largest, std::abs(residual[i]) / scale);
  }
  return largest;
}

ClampedBeam::Tip ClampedBeam::tip() const {
  const std::size_t i = q_.size() - 4;
  return {q_[i], q_[i + 1], std::atan2(q_[i + 3], q_[i + 2])};
}

}  // namespace oblique::validation
