#pragma once

namespace oblique::solver {

#if defined(__x86_64__)
/// What the wider kernels need of the machine that runs them.
inline bool has_avx512() {
  return __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512dq") != 0;
}
inline bool has_avx2() {
  return __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
}
#endif

}  // namespace oblique::solver
