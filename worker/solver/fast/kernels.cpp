#include "worker/solver/fast/kernels.h"

#include <vector>

namespace oblique::solver {
namespace {

std::vector<LaneKernel> find_kernels() {
  std::vector<LaneKernel> kernels;
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512dq") != 0) {
    kernels.push_back(avx512_kernel());
  }
  if (__builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0) {
    kernels.push_back(avx2_kernel());
  }
#endif
  kernels.push_back(baseline_kernel());
  return kernels;
}

}  // namespace

std::span<const LaneKernel> runnable_lane_kernels() {
  static const std::vector<LaneKernel> kernels = find_kernels();
  return kernels;
}

}  // namespace oblique::solver
