#include "worker/solver/fast/kernels.h"

namespace oblique::solver {
namespace {

template <class Constants>
std::span<const double> numbers(const Constants* first, std::size_t count) {
  static_assert(sizeof(Constants) % sizeof(double) == 0);
  return {reinterpret_cast<const double*>(first), count * sizeof(Constants) / sizeof(double)};
}

/// The arrays of constants as plain numbers, in the order of ChainTables.
std::array<std::span<const double>, 6> constants_of(const ChainTables<double>& chain) {
  return {
      numbers(chain.link, chain.links),    numbers(chain.mass_factor, chain.rows + kHalfBandwidth),
      numbers(chain.weight_N, chain.rows), numbers(chain.momentum_kg, chain.rows),
      numbers(chain.balance, chain.links), numbers(chain.tip_mass_kg, 1)};
}

}  // namespace

std::span<const LaneKernel> runnable_lane_kernels() {
  static const std::vector<LaneKernel> runnable = [] {
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
  }();
  return runnable;
}

double* LaneMemory::zeros(std::size_t entries) {
  constexpr std::size_t kLine = sizeof(Line) / sizeof(double);
  const std::size_t lines = (entries * lanes_ + kLine - 1) / kLine;
  return arrays_.emplace_back(std::make_unique<Line[]>(lines))[0].numbers;
}

void LaneMemory::write(double* array, std::size_t lane, std::span<const double> values) const {
  for (std::size_t i = 0; i < values.size(); ++i) {
    array[i * lanes_ + lane] = values[i];
  }
}

void LaneMemory::read(const double* array, std::size_t lane, std::span<double> values) const {
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = array[i * lanes_ + lane];
  }
}

LaneTables LaneMemory::tables(const ChainTables<double>& chain) {
  LaneTables tables{chain.rows, chain.tip_row, chain.links, chain.elements_per_link, {}};
  const auto constants = constants_of(chain);
  for (std::size_t i = 0; i < constants.size(); ++i) {
    tables.constants[i] = zeros(constants[i].size());
  }
  for (std::size_t lane = 0; lane < lanes_; ++lane) {
    write(tables, lane, chain);
  }
  return tables;
}

void LaneMemory::write(const LaneTables& tables, std::size_t lane,
                       const ChainTables<double>& chain) const {
  const auto constants = constants_of(chain);
  for (std::size_t i = 0; i < constants.size(); ++i) {
    write(tables.constants[i], lane, constants[i]);
  }
}

void LaneMemory::copy(const double* from, double* to, std::size_t lane, std::size_t entries) const {
  for (std::size_t i = lane; i < entries * lanes_; i += lanes_) {
    to[i] = from[i];
  }
}

bool have_one_shape(const ChainTables<double>& a, const ChainTables<double>& b) {
  return a.links == b.links && a.elements_per_link == b.elements_per_link;
}

}  // namespace oblique::solver
