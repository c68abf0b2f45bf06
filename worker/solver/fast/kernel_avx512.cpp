#include "worker/solver/fast/kernel_of.h"

oblique::solver::LaneKernel oblique::solver::avx512_kernel() {
  return kernel_of<LanePack<Avx512Vectors, 1>>("avx512");
}
