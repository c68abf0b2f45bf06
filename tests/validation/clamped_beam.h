#pragma once

#include <cstddef>
#include <vector>

namespace oblique::validation {

/// A straight cantilever of the solver's elements in static equilibrium, found by Newton's method
/// with the solver's own tangent. Clamped at the origin, along x.
class ClampedBeam {
 public:
  struct Properties {
    double length_m;
    double EA_N;
    double EI_N_m2;
    int elements;
  };
  struct TipLoad {
    double force_y_N;   ///< keeps its direction
    double moment_N_m;  ///< counter-clockwise
  };
  struct Tip {
    double x_m;
    double y_m;
    double angle_rad;  ///< of the tangent, in (-pi, pi]
  };

  explicit ClampedBeam(const Properties& properties);

  /// Goes to `load` in `increments` equal parts. Throws std::runtime_error when Newton's method
  /// does not converge: the largest correction, in units of an element's length for positions, does
  /// not fall below 1e-12 in 50 iterations.
  void load_to(const TipLoad& load, int increments);
  Tip tip() const;

 private:
  void equilibrate(const TipLoad& load);
  double newton_step(const TipLoad& load);

  Properties properties_;
  double element_length_m_;
  TipLoad load_{0.0, 0.0};
  std::vector<double> q_;  ///< x, y of position, x, y of slope, node by node
};

}  // namespace oblique::validation
