#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "worker/solver/fast/gauss_collocation.h"
#include "worker/solver/fast/lane_chains.h"

namespace oblique::solver {

/// Arrays of one PEFRL step of all lanes, element [i * lanes + lane]; aligned for the widest
/// vectors.
struct LaneArrays {
  double* q;
  double* v;
  double* q_next;
  double* v_next;
  double* scratch;
  double* h_s;  ///< one a lane
  double* inverse_h_Hz;
  double* force;      ///< fn0, ft0, k_nn, k_tn, k_tt, x0, y0: one a lane each
  double* integrals;  ///< impulse_n, impulse_t, work_t: one a lane each
  double* momenta;    ///< scratch for 4 entries a link
  double* reactions;  ///< squared means of the reactions: for each link one a lane
};

/// Arrays of one collocation step of all lanes, likewise. A vector has 2 rows entries.
struct CollocationArrays {
  LaneTables chain;
  double* mass_kg;  ///< diagonal of the mass matrix, one a row
  double* h_s;
  double* active;   ///< 1 where corrections are wanted, else 0
  double* state;    ///< q, v, and the mean acceleration over the step before: a vector each
  double* next;     ///< the same at the end of the step
  double* stage_q;  ///< a vector a stage, as the next two
  double* stage_a;
  double* work;
  double* tangents;  ///< TangentBlocks of each element
  double* fronts;    ///< ElementFront of each pair and element
  double* ends;      ///< EndFront of each pair and link
  double* squares;   ///< one a lane
};

/// The steps compiled for one instruction set. A lane gets the same bits whatever the others hold.
struct LaneKernel {
  std::string_view name;  ///< of the instruction set
  std::size_t lanes;
  /// PEFRL, of lanes that share a chain's constants, and of lanes with chains of their own. A lane
  /// gets the same bits from both.
  void (*step_one_chain)(const ChainTables<double>& chain, const LaneArrays& arrays);
  void (*step_chains)(const LaneTables& chains, const LaneArrays& arrays);
  /// Collocation: predicts, and factors the matrices of Newton's method.
  void (*prepare)(const GaussCollocation& rule, const CollocationArrays& arrays);
  /// One iteration in the lanes that are active. Leaves in `squares` the sum over stages and rows
  /// of mass times squared correction [kg m^2].
  void (*iterate)(const GaussCollocation& rule, const CollocationArrays& arrays);
  /// Puts the state at the end. Leaves in `squares` h^2 times the sum over rows of mass times the
  /// squares of the two highest Legendre coefficients of the accelerations [kg m^2/s^2].
  void (*finish)(const GaussCollocation& rule, const CollocationArrays& arrays);
};

/// Kernels that this machine can run, the fastest first; never empty.
std::span<const LaneKernel> runnable_lane_kernels();

LaneKernel baseline_kernel();  ///< for every machine: SSE2 on x86-64, NEON on arm64
#if defined(__x86_64__)
LaneKernel avx2_kernel();    ///< AVX2 and FMA
LaneKernel avx512_kernel();  ///< AVX-512 F and DQ
#endif

}  // namespace oblique::solver
