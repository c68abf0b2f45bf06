#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "worker/solver/fast/gauss_collocation.h"
#include "worker/solver/reference/chain_kernel.h"

namespace oblique::solver {

/// ChainTables of several chains: each constant has one number per lane.
struct LaneTables {
  std::size_t rows;
  std::size_t tip_row;
  std::size_t links;
  std::size_t elements_per_link;
  std::array<double*, 6> constants;  ///< in the order of ChainTables

  /// `Pack` must have one lane per chain.
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

/// Owns arrays with one number per lane in each entry: entry i of a lane is element
/// [i * lanes + lane]. Arrays are aligned for the widest vectors and never move.
class LaneMemory {
 public:
  explicit LaneMemory(std::size_t lanes) : lanes_(lanes) {}

  std::size_t lanes() const { return lanes_; }
  /// Returns a new array of zeros, which lives as long as this object.
  double* zeros(std::size_t entries);

  /// Writes `values` to the first entries of a lane of `array`.
  void write(double* array, std::size_t lane, std::span<const double> values) const;
  /// Reads `values` from the first entries of a lane of `array`.
  void read(const double* array, std::size_t lane, std::span<double> values) const;
  /// Returns new tables with `chain` in every lane.
  LaneTables tables(const ChainTables<double>& chain);
  void write(const LaneTables& tables, std::size_t lane, const ChainTables<double>& chain) const;
  /// Copies the first `entries` entries of a lane.
  void copy(const double* from, double* to, std::size_t lane, std::size_t entries) const;

 private:
  struct alignas(64) Line {
    double numbers[8];
  };
  std::size_t lanes_;
  std::vector<std::unique_ptr<Line[]>> arrays_;
};

/// Arrays of a LaneMemory for one PEFRL step. A vector has 2 * rows entries.
struct PefrlArrays {
  double* state;  ///< vectors q and v
  double* next;   ///< vectors q and v at the end of the step
  double* scratch;
  double* h_s;
  double* force;      ///< fn0, ft0, k_nn, k_tn, k_tt, x0, y0
  double* integrals;  ///< impulse_n, impulse_t, work_t
  double* momenta;    ///< scratch memory, 4 entries per link
  double* reactions;  ///< square of the mean reaction of each link
};

/// Arrays of a LaneMemory for one collocation step.
struct CollocationArrays {
  LaneTables chain;
  double* mass_kg;  ///< diagonal of the mass matrix, by row
  double* h_s;
  double* active;   ///< 1 in lanes that iterate, else 0
  double* state;    ///< vectors q, v, and the mean acceleration over the previous step
  double* next;     ///< the same vectors at the end of the step
  double* stage_q;  ///< one vector per stage, also in the next two arrays
  double* stage_a;
  double* work;
  double* tangents;  ///< TangentBlocks of each element
  double* factors;   ///< chain_factors() complex numbers for each pair of eigenvalues
  double* squares;
};

/// The steps compiled for one instruction set.
struct LaneKernel {
  std::string_view name;  ///< name of the instruction set
  std::size_t lanes;
  /// PEFRL for lanes that share the constants of a chain, and for lanes with different chains.
  void (*step_one_chain)(const ChainTables<double>& chain, const PefrlArrays& arrays);
  void (*step_chains)(const LaneTables& chains, const PefrlArrays& arrays);
  /// Collocation: predicts the stages and factors the matrices of Newton's method.
  void (*prepare)(const GaussCollocation& rule, const CollocationArrays& arrays);
  /// One iteration in active lanes. Sets `squares` to the sum over stages and rows of mass times
  /// squared correction [kg m^2].
  void (*iterate)(const GaussCollocation& rule, const CollocationArrays& arrays);
  /// Writes the state at the end. Sets `squares` to h^2 times the sum over rows of mass times the
  /// squares of the two highest Legendre coefficients of the accelerations [kg m^2/s^2].
  void (*finish)(const GaussCollocation& rule, const CollocationArrays& arrays);
};

/// Kernels that this machine can run, the fastest first; never empty.
std::span<const LaneKernel> runnable_lane_kernels();

LaneKernel baseline_kernel();  ///< for every machine: SSE2 on x86-64
#if defined(__x86_64__)
LaneKernel avx2_kernel();    ///< AVX2 and FMA
LaneKernel avx512_kernel();  ///< AVX-512 F and DQ
#endif

/// Whether chains have the same numbers of links and elements and thus can share lanes.
bool have_one_shape(const ChainTables<double>& a, const ChainTables<double>& b);

}  // namespace oblique::solver
