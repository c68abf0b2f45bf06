#include "worker/solver/lanes/lane_kernel_step.h"
#include "worker/solver/lanes/lane_kernels.h"

namespace oblique::solver {
namespace {

using Pack = LanePack<Avx512Vectors, 1>;

}  // namespace

LaneKernel avx512_kernel() {
  return {"avx512", Pack::kLanes, &step_one_chain<Pack>, &step_chains<Pack>,
          reaction_loops<Avx512Vectors>()};
}

}  // namespace oblique::solver
