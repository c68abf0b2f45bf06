#include "worker/solver/lanes/lane_kernel_step.h"
#include "worker/solver/lanes/lane_kernels.h"

namespace oblique::solver {
namespace {

struct Avx512Vectors {
  using Vector = double __attribute__((vector_size(64), may_alias));
};
using Pack = LanePack<Avx512Vectors, 1>;

}  // namespace

LaneKernel avx512_kernel() {
  return {"avx512", Pack::kLanes, &step_lanes<Pack>, reaction_loops<Avx512Vectors>()};
}

}  // namespace oblique::solver
