#include "worker/solver/fall/collocation_kernel.h"

namespace oblique::solver {

CollocationKernel avx2_collocation() {
  return collocation_kernel_of<LanePack<Avx2Vectors, 1>, kCollocationStages>("avx2");
}

}  // namespace oblique::solver
