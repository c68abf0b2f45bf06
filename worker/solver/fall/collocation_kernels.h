#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "worker/solver/chain/lane_chains.h"
#include "worker/solver/fall/gauss_collocation.h"

namespace oblique::solver {

/// What one step of all lanes reads and writes: each number stands once a lane, element
/// [i * lanes + lane], aligned for the widest vectors. A vector has 2 rows entries.
struct CollocationArrays {
  const GaussCollocation* rule;
  LaneTables chain;
  const double* elements;  ///< ElementConstants of each link
  const double* tip_mass_kg;
  const double* mass_kg;  ///< diagonal of the mass matrix, one a row
  const double* h_s;
  const double* active;  ///< 1 where corrections are wanted, else 0
  const double* q;
  const double* v;
  const double* mean;  ///< acceleration over the step before
  double* q_next;
  double* v_next;
  double* mean_next;
  double* stage_q;  ///< a vector a stage, as the next two
  double* stage_a;
  double* work;
  double* tangents;  ///< TangentBlocks of each element
  double* fronts;    ///< ElementFront of each pair and element
  double* ends;      ///< EndFront of each pair and link
  double* squares;   ///< one a lane
};

/// The parts of a step, compiled for one instruction set.
struct CollocationKernel {
  std::string_view name;  ///< of the instruction set
  std::size_t lanes;
  std::size_t stages;
  /// Predicts, and factors the matrices of Newton's method.
  void (*prepare)(const CollocationArrays& arrays);
  /// One iteration. Leaves in `squares` the sum over stages and rows of mass times squared
  /// correction [kg m^2].
  void (*iterate)(const CollocationArrays& arrays);
  /// Puts the state at the end. Leaves in `squares` h^2 times the sum over rows of mass times the
  /// squares of the two highest Legendre coefficients of the accelerations [kg m^2/s^2].
  void (*finish)(const CollocationArrays& arrays);
};

/// Stages of the kernels below, chosen by work and precision (README.md).
inline constexpr std::size_t kCollocationStages = 8;

/// Kernels that this machine can run, the fastest first; never empty.
std::span<const CollocationKernel> runnable_collocation_kernels();

/// For what every machine of the target has.
CollocationKernel baseline_collocation();
#if defined(__x86_64__)
CollocationKernel avx2_collocation();    ///< AVX2 and FMA
CollocationKernel avx512_collocation();  ///< AVX-512 F and DQ
#endif

}  // namespace oblique::solver
