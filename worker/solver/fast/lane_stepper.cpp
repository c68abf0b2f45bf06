#include "worker/solver/fast/lane_stepper.h"

#include <algorithm>
#include <array>
#include <utility>

namespace oblique::solver {

LaneStepper::LaneStepper(const ChainTables<double>& chain, const LaneKernel& kernel)
    : kernel_(kernel),
      vector_(2 * chain.rows),
      tip_row_(chain.tip_row),
      chains_(kernel.lanes),
      memory_(kernel.lanes),
      side_by_side_(memory_.tables(chain)),
      arrays_{.state = memory_.zeros(2 * vector_),
              .next = memory_.zeros(2 * vector_),
              .scratch = memory_.zeros(vector_),
              .h_s = memory_.zeros(1),
              .force = memory_.zeros(7),
              .integrals = memory_.zeros(3),
              .momenta = memory_.zeros(4 * chain.links),
              .reactions = memory_.zeros(chain.links)} {}

void LaneStepper::load(std::size_t lane, const ChainTables<double>& chain, const double* q,
                       const double* v) {
  chains_[lane] = chain;
  memory_.write(side_by_side_, lane, chain);
  compare_chains();
  memory_.write(arrays_.state, lane, {q, vector_});
  memory_.write(arrays_.state + vector_ * lanes(), lane, {v, vector_});
}

void LaneStepper::idle(std::size_t lane) {
  chains_[lane].reset();
  set_step(lane, 0.0);
  compare_chains();
}

void LaneStepper::compare_chains() {
  one_chain_ = nullptr;
  for (const auto& chain : chains_) {
    if (!chain) {
      continue;
    }
    if (one_chain_ != nullptr && one_chain_->link != chain->link) {
      one_chain_ = nullptr;
      return;
    }
    one_chain_ = &*chain;
  }
}

void LaneStepper::store(std::size_t lane, double* q, double* v) const {
  memory_.read(arrays_.state, lane, {q, vector_});
  memory_.read(arrays_.state + vector_ * lanes(), lane, {v, vector_});
}

void LaneStepper::set_force(std::size_t lane, const AffineContactForce<double>& force) {
  memory_.write(
      arrays_.force, lane,
      std::array{force.fn0, force.ft0, force.k_nn, force.k_tn, force.k_tt, force.x0, force.y0});
}

void LaneStepper::step() {
  if (one_chain_ != nullptr) {
    kernel_.step_one_chain(*one_chain_, arrays_);
  } else {
    kernel_.step_chains(side_by_side_, arrays_);
  }
}

ContactIntegrals<double> LaneStepper::integrals(std::size_t lane) const {
  std::array<double, 3> values;
  memory_.read(arrays_.integrals, lane, values);
  return {values[0], values[1], values[2]};
}

void LaneStepper::settle(std::span<const unsigned char> accept) {
  if (std::ranges::count(accept, 0) == std::ssize(accept)) {
    return;
  }
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    if (accept[lane] == 0) {
      memory_.copy(arrays_.state, arrays_.next, lane, 2 * vector_);
    }
  }
  std::swap(arrays_.state, arrays_.next);
}

}  // namespace oblique::solver
