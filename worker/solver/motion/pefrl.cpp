#include "worker/solver/motion/pefrl.h"

namespace oblique::solver {
namespace {

/// The map of q'' = -q over one step h is stable while |trace| <= 2.
constexpr bool is_stable(double h) {
  double half_trace = 0.0;
  for (int column = 0; column < 2; ++column) {
    double q = column == 0 ? 1.0 : 0.0;
    double v = column == 0 ? 0.0 : 1.0;
    for (std::size_t i = 0; i < Pefrl::kKicks; ++i) {
      q += Pefrl::drift[i] * h * v;
      v -= Pefrl::kick[i] * h * q;
    }
    q += Pefrl::drift[Pefrl::kKicks] * h * v;
    half_trace += 0.5 * (column == 0 ? q : v);
  }
  return half_trace <= 1.0 && half_trace >= -1.0;
}

constexpr double longest_stable() {
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

}  // namespace

double Pefrl::stability_limit() {
  constexpr double kLimit = longest_stable();  // found by the compiler: points ask for it often
  return kLimit;
}

}  // namespace oblique::solver
