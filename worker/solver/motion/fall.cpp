#include "worker/solver/motion/fall.h"

#include <cmath>
#include <string>
#include <utility>

#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"
#include "worker/solver/motion/stepped_path.h"

namespace oblique::solver {
namespace {

std::shared_ptr<const FallPath> stepped_path(const std::shared_ptr<const Motion>& motion,
                                             double dt_s, double longest_s,
                                             FallProgress* progress) {
  auto path = std::make_shared<SteppedPath>(motion, dt_s, longest_s, progress);
  ChainState before = motion->at_rest();
  ChainState state = before;
  for (;;) {
    motion->step(before, {}, dt_s, state);
    if (path->is_over_after_next(motion->tip(state))) {
      path->end(before);
      return path;
    }
    if (path->keeps_last()) {
      path->keep(state);
    }
    std::swap(before, state);
  }
}

}  // namespace

double longest_fall_s(const Chain& chain) {
  const double length_m = chain.tip(chain.at_rest()).x_m;
  return kLongestFall * std::sqrt(2.0 * length_m / chain.gravity_m_s2());
}

Fall::Fall(const Chain& chain, double dt_s)
    : Fall(std::make_shared<ExplicitMotion>(chain), dt_s, longest_fall_s(chain)) {}

Fall::Fall(std::shared_ptr<const Motion> motion, double dt_s, double longest_s,
           FallProgress* progress)
    : path_(stepped_path(motion, dt_s, longest_s, progress)) {}

ChainState Fall::state_at(double H_m) const {
  if (!(H_m > 0.0 && H_m <= largest_drop_m())) {
    throw InputError("H = " + exact_number(H_m) +
                     " m is not allowed: the tip of this model drops at most " +
                     readable_number(largest_drop_m(), 7) + " m before it turns back");
  }
  return path_->state_at(H_m);
}

}  // namespace oblique::solver
