#include "tests/bench/multiply_add_peak.h"

#include <benchmark/benchmark.h>

#include <chrono>
#include <cstddef>

namespace oblique::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kChains = 12;
constexpr int kRounds = 400'000;

template <class Vector>
inline __attribute__((always_inline)) void multiply_add(Vector* values) {
  Vector chain[kChains];
  for (std::size_t i = 0; i < kChains; ++i) {
    chain[i] = values[i];
  }
  const Vector factor = values[0] * 0.0 + 0.999;
  const Vector term = values[0] * 0.0 + 1e-3;
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < kChains; ++i) {
      chain[i] = chain[i] * factor + term;
    }
  }
  for (std::size_t i = 0; i < kChains; ++i) {
    values[i] = chain[i];
  }
}

template <std::size_t bytes>
struct Doubles {
  typedef double Vector __attribute__((vector_size(bytes)));
};

#if defined(__x86_64__)
__attribute__((target("avx512f,fma"))) void multiply_add_avx512(void* values) {
  multiply_add(static_cast<Doubles<64>::Vector*>(values));
}
__attribute__((target("avx2,fma"))) void multiply_add_avx2(void* values) {
  multiply_add(static_cast<Doubles<32>::Vector*>(values));
}
#endif
void multiply_add_baseline(void* values) {
  multiply_add(static_cast<Doubles<16>::Vector*>(values));
}

}  // namespace

double multiply_add_peak_per_s(std::string_view instruction_set) {
  alignas(64) double values[kChains * 8] = {};
  std::size_t lanes = 2;
  void (*run)(void*) = multiply_add_baseline;
#if defined(__x86_64__)
  if (instruction_set == "avx512") {
    lanes = 8;
    run = multiply_add_avx512;
  } else if (instruction_set == "avx2") {
    lanes = 4;
    run = multiply_add_avx2;
  }
#endif
  run(values);  // warm
  const auto start = Clock::now();
  run(values);
  benchmark::DoNotOptimize(values);
  const std::chrono::duration<double> elapsed = Clock::now() - start;
  return 2.0 * static_cast<double>(lanes * kChains) * kRounds / elapsed.count();
}

}  // namespace oblique::bench
