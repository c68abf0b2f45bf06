#include "worker/solver/fast/kernels.h"

#include <array>
#include <cstring>
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

/// One array of a chain's constants as plain numbers.
struct Numbers {
  const double* first;
  std::size_t count;
};

template <class Constants>
Numbers numbers(const Constants* first, std::size_t count) {
  static_assert(sizeof(Constants) % sizeof(double) == 0);
  return {reinterpret_cast<const double*>(first), count * sizeof(Constants) / sizeof(double)};
}

std::array<Numbers, LaneTables::kArrays> constants_of(const ChainTables<double>& chain) {
  return {
      numbers(chain.link, chain.links),    numbers(chain.mass_factor, chain.rows + kHalfBandwidth),
      numbers(chain.weight_N, chain.rows), numbers(chain.momentum_kg, chain.rows),
      numbers(chain.balance, chain.links), numbers(chain.tip_mass_kg, 1)};
}

}  // namespace

std::span<const LaneKernel> runnable_lane_kernels() {
  static const std::vector<LaneKernel> kernels = find_kernels();
  return kernels;
}

bool have_one_shape(const ChainTables<double>& a, const ChainTables<double>& b) {
  return a.links == b.links && a.elements_per_link == b.elements_per_link;
}

bool are_equal(const ChainTables<double>& a, const ChainTables<double>& b) {
  if (!have_one_shape(a, b)) {
    return false;
  }
  const auto of_a = constants_of(a);
  const auto of_b = constants_of(b);
  for (std::size_t i = 0; i < of_a.size(); ++i) {
    if (of_a[i].first != of_b[i].first &&
        std::memcmp(of_a[i].first, of_b[i].first, of_a[i].count * sizeof(double)) != 0) {
      return false;
    }
  }
  return true;
}

LaneChains::LaneChains(const ChainTables<double>& chain, std::size_t lanes)
    : lanes_(lanes),
      tables_{chain.rows, chain.tip_row, chain.links, chain.elements_per_link, {}},
      memory_(lanes) {
  const auto constants = constants_of(chain);
  for (std::size_t i = 0; i < constants.size(); ++i) {
    tables_.constants[i] = memory_.zeros(constants[i].count);
  }
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    set(lane, chain);
  }
}

void LaneChains::set(std::size_t lane, const ChainTables<double>& chain) {
  const auto constants = constants_of(chain);
  for (std::size_t array = 0; array < constants.size(); ++array) {
    double* to = tables_.constants[array] + lane;
    for (std::size_t i = 0; i < constants[array].count; ++i) {
      to[i * lanes_] = constants[array].first[i];
    }
  }
}

}  // namespace oblique::solver
