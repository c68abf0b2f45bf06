#include "client/verbs/tip_reach.h"

#include "worker/solver/solve.h"

namespace oblique::client {

ReachCheck tip_reach() {
  return ReachChecker(
      [](const solver::ModelParameters& model) { return solver::Finger(model).largest_drop_m(); });
}

}  // namespace oblique::client
