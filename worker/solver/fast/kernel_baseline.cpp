#include "worker/solver/fast/kernel_of.h"

oblique::solver::LaneKernel oblique::solver::baseline_kernel() {
  return kernel_of<LanePack<BaselineVectors, 2>>("baseline");
}
