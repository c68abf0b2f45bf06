#include "worker/solver/fall/collocation_kernel.h"

namespace oblique::solver {

CollocationKernel avx512_collocation() {
  return collocation_kernel_of<LanePack<Avx512Vectors, 1>, kCollocationStages>("avx512");
}

}  // namespace oblique::solver
