#include "worker/solver/fast/kernel_of.h"

namespace oblique::solver {

LaneKernel baseline_kernel() {
  return kernel_of<LanePack<BaselineVectors, 2>>("baseline");
}

}  // namespace oblique::solver
