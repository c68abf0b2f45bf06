#pragma once

#include "worker/solver/lanes/lane_stepper.h"

namespace oblique::solver {

/// The step for what every machine of the target has: SSE2 on x86-64, NEON on arm64.
LaneKernel baseline_kernel();
#if defined(__x86_64__)
LaneKernel avx2_kernel();    ///< AVX2 and FMA
LaneKernel avx512_kernel();  ///< AVX-512 F and DQ
#endif

}  // namespace oblique::solver
