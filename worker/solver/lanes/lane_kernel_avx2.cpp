#include "worker/solver/lanes/lane_kernel_step.h"
#include "worker/solver/lanes/lane_kernels.h"

namespace oblique::solver {
namespace {

using Pack = LanePack<Avx2Vectors, 1>;

}  // namespace

LaneKernel avx2_kernel() {
  return {"avx2", Pack::kLanes, &step_one_chain<Pack>, &step_chains<Pack>,
          reaction_loops<Avx2Vectors>()};
}

}  // namespace oblique::solver
