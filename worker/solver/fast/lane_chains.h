#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "worker/solver/reference/chain_kernel.h"

namespace oblique::solver {

/// Arrays of numbers, one a lane each, in one block of memory: each begins on a line as wide as the
/// widest vector.
class LaneMemory {
 public:
  struct Array {
    double** start;     ///< set by allocate()
    std::size_t count;  ///< of numbers a lane
  };
  /// Zeros. Earlier arrays are gone.
  void allocate(std::span<const Array> arrays, std::size_t lanes);

 private:
  struct alignas(64) Line {
    double numbers[8];
  };
  std::vector<Line> lines_;
};

/// Tables of chains side by side as a kernel behind a pointer to a function takes them: the same as
/// ChainTables, each constant one number a lane. Aligned for the widest vectors.
struct LaneTables {
  static constexpr std::size_t kArrays = 6;

  std::size_t rows;
  std::size_t tip_row;
  std::size_t links;
  std::size_t elements_per_link;
  std::array<double*, kArrays> constants;  ///< in the order of ChainTables

  /// As packs of as many lanes as there are chains.
  template <class Pack>
  inline ChainTables<Pack> of() const {
    return {rows,
            tip_row,
            links,
            elements_per_link,
            reinterpret_cast<const ElementConstants<Pack>*>(constants[0]),
            reinterpret_cast<const FactorRow<Pack>*>(constants[1]),
            reinterpret_cast<const Pack*>(constants[2]),
            reinterpret_cast<const Pack*>(constants[3]),
            reinterpret_cast<const LinkBalance<Pack>*>(constants[4]),
            reinterpret_cast<const Pack*>(constants[5])};
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
  const LaneTables& tables() const { return tables_; }

 private:
  std::size_t lanes_;
  LaneTables tables_;
  LaneMemory memory_;
};

}  // namespace oblique::solver
