#include "worker/solver/fall/collocation_kernel.h"

namespace oblique::solver {

CollocationKernel baseline_collocation() {
  return collocation_kernel_of<LanePack<BaselineVectors, 2>, kCollocationStages>("baseline");
}

}  // namespace oblique::solver
