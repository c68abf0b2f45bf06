#include "worker/solver/lanes/lane_kernel_step.h"
#include "worker/solver/lanes/lane_kernels.h"

namespace oblique::solver {
namespace {

struct Avx2Vectors {
  using Vector = double __attribute__((vector_size(32), may_alias));
};
using Pack = LanePack<Avx2Vectors, 1>;

}  // namespace

LaneKernel avx2_kernel() {
  return {"avx2", Pack::kLanes, &step_lanes<Pack>, reaction_loops<Avx2Vectors>()};
}

}  // namespace oblique::solver
