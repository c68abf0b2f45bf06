#include "worker/solver/fast/collocation_lanes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "worker/solver/fast/front_kernel.h"

namespace oblique::solver {
namespace {

constexpr int kMaxIterations = 10;
/// A correction that no longer shrinks is rounding error if at most this times the allowed error.
constexpr double kRoundingErrors = 1000.0;

}  // namespace

CollocationLanes::CollocationLanes(const LaneKernel& kernel, const Chain& chain)
    : kernel_(kernel),
      vector_(2 * static_cast<std::size_t>(chain.rows())),
      memory_(kernel.lanes),
      total_kg_(kernel.lanes),
      correction_m_(kernel.lanes),
      steps_(kernel.lanes) {
  const LaneTables tables = memory_.tables(chain.tables());
  const std::size_t elements = tables.links * tables.elements_per_link;
  const std::size_t factors =
      GaussCollocation::kPairs * chain_factors(tables.links, tables.elements_per_link);
  arrays_ = {.chain = tables,
             .mass_kg = memory_.zeros(tables.rows),
             .h_s = memory_.zeros(1),
             .active = memory_.zeros(1),
             .state = memory_.zeros(3 * vector_),
             .next = memory_.zeros(3 * vector_),
             .stage_q = memory_.zeros(GaussCollocation::kStages * vector_),
             .stage_a = memory_.zeros(GaussCollocation::kStages * vector_),
             .work = memory_.zeros(GaussCollocation::kStages * vector_),
             .tangents = memory_.zeros(elements * sizeof(TangentBlocks<double>) / sizeof(double)),
             .factors = memory_.zeros(2 * factors),
             .squares = memory_.zeros(1)};
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    load(lane, chain);
  }
}

void CollocationLanes::load(std::size_t lane, const Chain& chain) {
  memory_.write(arrays_.chain, lane, chain.tables());
  total_kg_[lane] = chain.mass_kg();
  const ChainState rest = chain.at_rest();
  std::vector<double> state(rest.q.data(), rest.q.data() + vector_);
  state.resize(3 * vector_, 0.0);
  set_state(lane, state);
}

std::vector<double> CollocationLanes::state(std::size_t lane) const {
  std::vector<double> q_v_mean(3 * vector_);
  memory_.read(arrays_.state, lane, q_v_mean);
  return q_v_mean;
}

void CollocationLanes::set_state(std::size_t lane, const std::vector<double>& q_v_mean) {
  memory_.write(arrays_.state, lane, q_v_mean);
}

void CollocationLanes::attempt() {
  bool is_any_active = false;
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    Step& step = steps_[lane];
    step = {.h_s = step.h_s, .error_m = step.error_m};
    arrays_.h_s[lane] = step.h_s;
    arrays_.active[lane] = step.h_s > 0.0 ? 1.0 : 0.0;
    is_any_active = is_any_active || step.h_s > 0.0;
  }
  kernel_.prepare(gauss_collocation(), arrays_);
  for (int iteration = 1; is_any_active; ++iteration) {
    is_any_active = iterate(iteration);
  }
  kernel_.finish(gauss_collocation(), arrays_);
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    steps_[lane].unresolved_m_s = std::sqrt(arrays_.squares[lane] / total_kg_[lane]);
  }
}

/// Does iteration number `iteration` >= 1 of Newton's method. Returns whether a lane needs more.
bool CollocationLanes::iterate(int iteration) {
  kernel_.iterate(gauss_collocation(), arrays_);
  bool is_any_active = false;
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    if (arrays_.active[lane] == 0.0) {
      continue;
    }
    Step& step = steps_[lane];
    step.iterations = iteration;
    const double size_m = std::sqrt(arrays_.squares[lane] / total_kg_[lane]);
    // The remaining error is the sum of the next corrections: a geometric series.
    const double ratio = iteration > 1 ? size_m / correction_m_[lane] : 1.0;
    const bool is_rounding =
        iteration > 2 && ratio > 0.1 && size_m <= kRoundingErrors * step.error_m;
    step.converged =
        size_m <= step.error_m || is_rounding || (ratio < 0.5 && size_m * ratio <= step.error_m);
    const bool is_hopeless = !std::isfinite(size_m) || ratio > 2.0 || iteration >= kMaxIterations;
    correction_m_[lane] = size_m;
    const bool goes_on = !step.converged && !is_hopeless;
    arrays_.active[lane] = goes_on ? 1.0 : 0.0;
    is_any_active = is_any_active || goes_on;
  }
  return is_any_active;
}

void CollocationLanes::accept() {
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    if (!steps_[lane].is_accepted) {
      memory_.copy(arrays_.state, arrays_.next, lane, 3 * vector_);
    }
  }
  std::swap(arrays_.state, arrays_.next);
}

CollocationLanes::Coordinate CollocationLanes::coordinate(std::size_t lane, std::size_t i) const {
  const std::size_t stride = vector_ * lanes();
  const std::size_t first = i * lanes() + lane;
  Coordinate coordinate{arrays_.h_s[lane], arrays_.state[first], arrays_.state[first + stride], {}};
  for (std::size_t stage = 0; stage < coordinate.a.size(); ++stage) {
    coordinate.a[stage] = arrays_.stage_a[first + stage * stride];
  }
  return coordinate;
}

}  // namespace oblique::solver
