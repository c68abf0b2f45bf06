#include "tests/worker/solver/fall/precision/stage_kernels.h"

#include "worker/solver/fall/collocation_kernel.h"

namespace oblique::bench {
namespace {

using Pack = solver::LanePack<solver::BaselineVectors, 2>;

}  // namespace

std::vector<solver::CollocationKernel> stage_kernels() {
  using solver::collocation_kernel_of;
  return {collocation_kernel_of<Pack, 2>("2 stages"), collocation_kernel_of<Pack, 3>("3 stages"),
          collocation_kernel_of<Pack, 4>("4 stages"), collocation_kernel_of<Pack, 6>("6 stages"),
          collocation_kernel_of<Pack, 8>("8 stages")};
}

}  // namespace oblique::bench
