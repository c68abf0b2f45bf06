#include "worker/solver/chain/lane_chains.h"

#include <array>
#include <cstring>

namespace oblique::solver {
namespace {

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

/// In the order of LaneTables.
std::array<Numbers, 5> constants_of(const ChainTables<double>& chain) {
  return {numbers(chain.link, chain.links), numbers(chain.mass_factor, chain.rows + kHalfBandwidth),
          numbers(chain.weight_N, chain.rows), numbers(chain.momentum_kg, chain.rows),
          numbers(chain.balance, chain.links)};
}

}  // namespace

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
    : shape_(chain), lanes_(lanes) {
  std::size_t count = 0;
  for (const Numbers& array : constants_of(chain)) {
    count += array.count * lanes;
  }
  constexpr std::size_t kLine = sizeof(Line) / sizeof(double);
  memory_.resize((count + kLine - 1) / kLine);
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    set(lane, chain);
  }
}

void LaneChains::set(std::size_t lane, const ChainTables<double>& chain) {
  double* to = memory_.front().numbers + lane;
  for (const Numbers& array : constants_of(chain)) {
    for (std::size_t i = 0; i < array.count; ++i) {
      *to = array.first[i];
      to += lanes_;
    }
  }
}

LaneTables LaneChains::tables() const {
  std::array<const double*, 5> start{};
  const double* next = memory_.front().numbers;
  const auto arrays = constants_of(shape_);
  for (std::size_t i = 0; i < start.size(); ++i) {
    start[i] = next;
    next += arrays[i].count * lanes_;
  }
  return {shape_.rows, shape_.tip_row, shape_.links, shape_.elements_per_link, start[0], start[1],
          start[2],    start[3],       start[4]};
}

}  // namespace oblique::solver
