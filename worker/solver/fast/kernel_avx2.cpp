#include "worker/solver/fast/kernel_of.h"

namespace oblique::solver {

LaneKernel avx2_kernel() {
  return kernel_of<LanePack<Avx2Vectors, 1>>("avx2");
}

}  // namespace oblique::solver
