#include "worker/solver/fast/lane_stepper.h"

#include <algorithm>
#include <utility>

namespace oblique::solver {

LaneStepper::LaneStepper(const ChainTables<double>& chain, const LaneKernel& kernel)
    : kernel_(kernel),
      size_(2 * chain.rows),
      chains_(kernel.lanes),
      is_copied_(kernel.lanes, 0),
      side_by_side_(chain, kernel.lanes),
      memory_(kernel.lanes) {
  for (double** const array :
       {&arrays_.q, &arrays_.v, &arrays_.q_next, &arrays_.v_next, &arrays_.scratch}) {
    *array = memory_.zeros(size_);
  }
  arrays_.h_s = memory_.zeros(1);
  arrays_.inverse_h_Hz = memory_.zeros(1);
  arrays_.force = memory_.zeros(7);
  arrays_.integrals = memory_.zeros(3);
  arrays_.momenta = memory_.zeros(4 * chain.links);
  arrays_.reactions = memory_.zeros(chain.links);
}

void LaneStepper::load(std::size_t lane, const ChainTables<double>& chain, const double* q,
                       const double* v) {
  chains_[lane] = chain;
  is_copied_[lane] = 0;
  compare_chains();
  for (std::size_t i = 0; i < size_; ++i) {
    arrays_.q[i * lanes() + lane] = q[i];
    arrays_.v[i * lanes() + lane] = v[i];
  }
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
    if (one_chain_ != nullptr && !are_equal(*one_chain_, *chain)) {
      one_chain_ = nullptr;
      return;
    }
    one_chain_ = &*chain;
  }
}

void LaneStepper::store(std::size_t lane, double* q, double* v) const {
  for (std::size_t i = 0; i < size_; ++i) {
    q[i] = arrays_.q[i * lanes() + lane];
    v[i] = arrays_.v[i * lanes() + lane];
  }
}

void LaneStepper::set_force(std::size_t lane, const AffineContactForce<double>& force) {
  double* entry = arrays_.force + lane;
  for (const double value :
       {force.fn0, force.ft0, force.k_nn, force.k_tn, force.k_tt, force.x0, force.y0}) {
    *entry = value;
    entry += lanes();
  }
}

void LaneStepper::step() {
  if (one_chain_ != nullptr) {
    kernel_.step_one_chain(*one_chain_, arrays_);
    return;
  }
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    if (chains_[lane] && is_copied_[lane] == 0) {
      side_by_side_.set(lane, *chains_[lane]);
      is_copied_[lane] = 1;
    }
  }
  kernel_.step_chains(side_by_side_.tables(), arrays_);
}

ContactIntegrals<double> LaneStepper::integrals(std::size_t lane) const {
  return {arrays_.integrals[lane], arrays_.integrals[lanes() + lane],
          arrays_.integrals[2 * lanes() + lane]};
}

void LaneStepper::settle(std::span<const unsigned char> accept) {
  const auto accepted = static_cast<std::size_t>(
      std::count_if(accept.begin(), accept.end(), [](auto a) { return a != 0; }));
  if (accepted == 0) {
    return;
  }
  for (std::size_t lane = 0; lane < lanes() && accepted < lanes(); ++lane) {
    if (accept[lane] != 0) {
      continue;
    }
    for (std::size_t i = lane; i < size_ * lanes(); i += lanes()) {
      arrays_.q_next[i] = arrays_.q[i];
      arrays_.v_next[i] = arrays_.v[i];
    }
  }
  std::swap(arrays_.q, arrays_.q_next);
  std::swap(arrays_.v, arrays_.v_next);
}

}  // namespace oblique::solver
