#include "worker/solver/model/version.h"

namespace oblique::solver {

std::string solver_version() {
  return OBLIQUE_SOLVER_VERSION;
}

}  // namespace oblique::solver
