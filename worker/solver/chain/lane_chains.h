#pragma once

#include <cstddef>
#include <vector>

#include "worker/solver/chain/chain_kernel.h"

namespace oblique::solver {

/// Tables of chains side by side as a kernel behind a pointer to a function takes them: the same as
/// ChainTables, each constant one number a lane. Aligned for the widest vectors.
struct LaneTables {
  std::size_t rows;
  std::size_t tip_row;
  std::size_t links;
  std::size_t elements_per_link;
  const double* link;
  const double* mass_factor;
  const double* weight_N;
  const double* momentum_kg;
  const double* balance;

  /// As packs of as many lanes as there are chains.
  template <class Pack>
  inline ChainTables<Pack> of() const {
    return {rows,
            tip_row,
            links,
            elements_per_link,
            reinterpret_cast<const ElasticConstants<Pack>*>(link),
            reinterpret_cast<const FactorRow<Pack>*>(mass_factor),
            reinterpret_cast<const Pack*>(weight_N),
            reinterpret_cast<const Pack*>(momentum_kg),
            reinterpret_cast<const LinkBalance<Pack>*>(balance)};
  }
};

/// Whether chains have the same numbers of links and elements, so that they fit side by side.
bool have_one_shape(const ChainTables<double>& a, const ChainTables<double>& b);
/// Whether chains have one shape and equal constants: they move alike.
bool are_equal(const ChainTables<double>& a, const ChainTables<double>& b);

/// The tables of as many chains of one shape as there are lanes.
class LaneChains {
 public:
  /// Every lane has `chain` until it is given another.
  LaneChains(const ChainTables<double>& chain, std::size_t lanes);

  /// Copies the constants of `chain`, of the shape given at construction, into a lane.
  void set(std::size_t lane, const ChainTables<double>& chain);

  /// Points into this.
  LaneTables tables() const;

 private:
  /// As wide as the widest vector: no array of lanes is aligned to less.
  struct alignas(64) Line {
    double numbers[8];
  };
  ChainTables<double> shape_;  ///< whose arrays are not read
  std::size_t lanes_;
  std::vector<Line> memory_;
};

}  // namespace oblique::solver
