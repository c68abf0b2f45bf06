#include "worker/solver/lanes/lane_kernel_step.h"
#include "worker/solver/lanes/lane_kernels.h"

namespace oblique::solver {
namespace {

using Pack = LanePack<BaselineVectors, 2>;

}  // namespace

LaneKernel baseline_kernel() {
  return {"baseline", Pack::kLanes, &step_one_chain<Pack>, &step_chains<Pack>,
          reaction_loops<BaselineVectors>()};
}

}  // namespace oblique::solver
