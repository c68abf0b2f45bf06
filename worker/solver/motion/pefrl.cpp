#include "worker/solver/motion/pefrl.h"

#include <cmath>

namespace oblique::solver {

double Pefrl::stability_limit() {
  // The map of q'' = -q over one step is stable while |trace| <= 2.
  const auto is_stable = [](double h) {
    double half_trace = 0.0;
    for (int column = 0; column < 2; ++column) {
      double q = column == 0 ? 1.0 : 0.0;
      double v = column == 0 ? 0.0 : 1.0;
      for (std::size_t i = 0; i < kKicks; ++i) {
        q += drift[i] * h * v;
        v -= kick[i] * h * q;
      }
      q += drift[kKicks] * h * v;
      half_trace += 0.5 * (column == 0 ? q : v);
    }
    return std::abs(half_trace) <= 1.0;
  };
  double stable = 1.0;
  while (is_stable(stable + 0.01)) {
    stable += 0.01;
  }
  double unstable = stable + 0.01;
  while (unstable - stable > 1e-12) {
    const double middle = 0.5 * (stable + unstable);
    (is_stable(middle) ? stable : unstable) = middle;
  }
  return stable;
}

}  // namespace oblique::solver
