#include "worker/solver/fast/kernel_of.h"

namespace oblique::solver {

LaneKernel avx512_kernel() {
  return kernel_of<LanePack<Avx512Vectors, 1>>("avx512");
}

}  // namespace oblique::solver
