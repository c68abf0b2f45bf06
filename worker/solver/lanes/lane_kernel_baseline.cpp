#include "worker/solver/lanes/lane_kernel_step.h"
#include "worker/solver/lanes/lane_kernels.h"

namespace oblique::solver {
namespace {

struct BaselineVectors {
  using Vector = double __attribute__((vector_size(16), may_alias));
};
using Pack = LanePack<BaselineVectors, 2>;

}  // namespace

LaneKernel baseline_kernel() {
  return {"baseline", Pack::kLanes, &step_lanes<Pack>, reaction_loops<BaselineVectors>()};
}

}  // namespace oblique::solver
