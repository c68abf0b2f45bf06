#pragma once

#include <vector>

#include "worker/solver/fall/collocation_kernels.h"

namespace oblique::bench {

/// Kernels of 2, 3, 4, 6 and 8 stages for what every machine of the target has.
std::vector<solver::CollocationKernel> stage_kernels();

}  // namespace oblique::bench
