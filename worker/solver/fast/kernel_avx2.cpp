#include "worker/solver/fast/kernel_of.h"

oblique::solver::LaneKernel oblique::solver::avx2_kernel() {
  return kernel_of<LanePack<Avx2Vectors, 1>>("avx2");
}
