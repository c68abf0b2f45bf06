#include "worker/solver/fast/collocation_lanes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "worker/solver/fast/front_kernel.h"

namespace oblique::solver {
namespace {

/// After so many iterations the step is taken to be too long.
constexpr int kMostIterations = 10;
/// Corrections that no longer shrink are rounding when they are below this many errors allowed.
constexpr double kRoundingErrors = 1000.0;

template <class Item>
constexpr std::size_t numbers_of() {
  return sizeof(Item) / sizeof(double);
}

}  // namespace

CollocationLanes::CollocationLanes(const LaneKernel& kernel, const Chain& chain)
    : kernel_(kernel),
      size_(2 * static_cast<std::size_t>(chain.rows())),
      chains_(chain.tables(), kernel.lanes),
      total_kg_(kernel.lanes) {
  constexpr std::size_t kStages = GaussCollocation::kStages;
  constexpr std::size_t kPairs = GaussCollocation::kPairs;
  const std::size_t links = chain.links();
  const std::size_t elements = links * chain.tables().elements_per_link;
  const std::array<LaneMemory::Array, 12> arrays{
      {{&arrays_.mass_kg, size_ / 2},
       {&arrays_.h_s, 1},
       {&arrays_.active, 1},
       {&arrays_.state, 3 * size_},
       {&arrays_.next, 3 * size_},
       {&arrays_.stage_q, kStages * size_},
       {&arrays_.stage_a, kStages * size_},
       {&arrays_.work, 2 * kPairs * size_},
       {&arrays_.tangents, elements * numbers_of<TangentBlocks<double>>()},
       {&arrays_.fronts, kPairs * elements * numbers_of<ElementFront<double>>()},
       {&arrays_.ends, kPairs * links * numbers_of<EndFront<double>>()},
       {&arrays_.squares, 1}}};
  memory_.allocate(arrays, kernel.lanes);
  arrays_.chain = chains_.tables();
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    load(lane, chain);
  }
}

void CollocationLanes::load(std::size_t lane, const Chain& chain) {
  const ChainTables<double> tables = chain.tables();
  chains_.set(lane, tables);
  std::vector<double> kg(size_ / 2, 0.0);
  std::size_t row = 0;
  for (std::size_t link = 0; link < tables.links; ++link) {
    const ElementConstants<double>& constants = tables.link[link];
    for (std::size_t e = 1; e <= tables.elements_per_link; ++e) {
      const ElementRows at =
          rows_of_element(row, e == tables.elements_per_link && link + 1 < tables.links);
      kg[at.p_i] += constants.m_pp;
      kg[at.s_i] += constants.m_ss;
      kg[at.p_j] += constants.m_pp;
      kg[at.s_j] += constants.m_ss;
      row = at.p_j;
    }
  }
  kg[row] += *tables.tip_mass_kg;
  for (std::size_t i = 0; i < kg.size(); ++i) {
    arrays_.mass_kg[i * lanes() + lane] = kg[i];
  }
  total_kg_[lane] = chain.mass_kg();
  const ChainState rest = chain.at_rest();
  const std::vector<double> none(size_, 0.0);
  set_state(lane, rest.q.data(), rest.v.data(), none.data());
}

void CollocationLanes::set_state(std::size_t lane, const double* q, const double* v,
                                 const double* mean) {
  double* to = arrays_.state + lane;
  for (const double* from : {q, v, mean}) {
    for (std::size_t i = 0; i < size_; ++i) {
      *to = from[i];
      to += lanes();
    }
  }
}

void CollocationLanes::attempt(std::span<const double> h_s, std::span<const double> error_m,
                               std::span<Attempt> attempts) {
  std::vector<double> before_m(lanes(), 0.0);
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    arrays_.h_s[lane] = h_s[lane];
    arrays_.active[lane] = h_s[lane] > 0.0 ? 1.0 : 0.0;
    attempts[lane] = {};
  }
  const auto any_is_active = [this] {
    return std::any_of(arrays_.active, arrays_.active + lanes(),
                       [](double active) { return active != 0.0; });
  };
  kernel_.prepare(gauss_collocation(), arrays_);
  for (int iteration = 1; any_is_active(); ++iteration) {
    kernel_.iterate(gauss_collocation(), arrays_);
    for (std::size_t lane = 0; lane < lanes(); ++lane) {
      if (arrays_.active[lane] == 0.0) {
        continue;
      }
      Attempt& attempt = attempts[lane];
      attempt.iterations = iteration;
      const double size_m = std::sqrt(arrays_.squares[lane] / total_kg_[lane]);
      // What is left is the next correction and those after it: a geometric series.
      const double ratio = iteration > 1 ? size_m / before_m[lane] : 1.0;
      const bool is_rounding =
          iteration > 2 && ratio > 0.1 && size_m <= kRoundingErrors * error_m[lane];
      attempt.converged = size_m <= error_m[lane] || is_rounding ||
                          (ratio < 0.5 && size_m * ratio <= error_m[lane]);
      const bool is_hopeless =
          !std::isfinite(size_m) || ratio > 2.0 || iteration >= kMostIterations;
      if (attempt.converged || is_hopeless) {
        arrays_.active[lane] = 0.0;
      }
      before_m[lane] = size_m;
    }
  }
  kernel_.finish(gauss_collocation(), arrays_);
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    attempts[lane].unresolved_m_s = std::sqrt(arrays_.squares[lane] / total_kg_[lane]);
  }
}

void CollocationLanes::settle(std::span<const unsigned char> accept) {
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    if (accept[lane] == 0) {
      for (std::size_t i = lane; i < 3 * size_ * lanes(); i += lanes()) {
        arrays_.next[i] = arrays_.state[i];
      }
    }
  }
  std::swap(arrays_.state, arrays_.next);
}

void CollocationLanes::copy_state(std::size_t lane, double* q_v_mean) const {
  for (std::size_t i = 0; i < 3 * size_; ++i) {
    q_v_mean[i] = arrays_.state[i * lanes() + lane];
  }
}

void CollocationLanes::copy_stages(std::size_t lane, double* accelerations) const {
  for (std::size_t i = 0; i < GaussCollocation::kStages * size_; ++i) {
    accelerations[i] = arrays_.stage_a[i * lanes() + lane];
  }
}

}  // namespace oblique::solver
