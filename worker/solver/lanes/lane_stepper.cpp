#include "worker/solver/lanes/lane_stepper.h"

#include <algorithm>
#include <cstdint>

#include "worker/solver/chain/instruction_sets.h"
#include "worker/solver/lanes/lane_kernels.h"

namespace oblique::solver {
namespace {

/// Vectors of 512 bits want their arrays on 64 bytes.
constexpr std::size_t kAlignment = 64;

std::vector<LaneKernel> find_kernels() {
  std::vector<LaneKernel> kernels;
#if defined(__x86_64__)
  if (has_avx512()) {
    kernels.push_back(avx512_kernel());
  }
  if (has_avx2()) {
    kernels.push_back(avx2_kernel());
  }
#endif
  kernels.push_back(baseline_kernel());
  return kernels;
}

}  // namespace

std::span<const LaneKernel> runnable_lane_kernels() {
  static const std::vector<LaneKernel> kernels = find_kernels();
  return kernels;
}

LaneStepper::LaneStepper(const ChainTables<double>& chain, const LaneKernel& kernel)
    : kernel_(kernel),
      size_(2 * chain.rows),
      chains_(kernel.lanes),
      is_side_by_side_(kernel.lanes, 0) {
  const std::size_t state = size_ * lanes();
  const std::size_t small = std::max(lanes(), kAlignment / sizeof(double));
  memory_.assign(5 * state + (2 + 7 + 3 + 5 * chain.links) * small + kAlignment / sizeof(double),
                 0.0);
  const auto address = reinterpret_cast<std::uintptr_t>(memory_.data());
  double* next = memory_.data() + (kAlignment - address % kAlignment) % kAlignment / sizeof(double);
  const auto take = [&next](std::size_t count) {
    double* taken = next;
    next += count;
    return taken;
  };
  q_ = take(state);
  v_ = take(state);
  q_next_ = take(state);
  v_next_ = take(state);
  scratch_ = take(state);
  h_s_ = take(small);
  inverse_h_Hz_ = take(small);
  force_ = take(7 * small);
  integrals_ = take(3 * small);
  momenta_ = take(4 * chain.links * small);
  reactions_ = take(chain.links * small);
}

void LaneStepper::load(std::size_t lane, const ChainTables<double>& chain, const double* q,
                       const double* v) {
  chains_[lane] = chain;
  is_side_by_side_[lane] = 0;
  compare_chains();
  for (std::size_t i = 0; i < size_; ++i) {
    q_[i * lanes() + lane] = q[i];
    v_[i * lanes() + lane] = v[i];
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
    q[i] = q_[i * lanes() + lane];
    v[i] = v_[i * lanes() + lane];
  }
}

void LaneStepper::set_force(std::size_t lane, const AffineContactForce<double>& force) {
  double* entry = force_ + lane;
  for (const double value :
       {force.fn0, force.ft0, force.k_nn, force.k_tn, force.k_tt, force.x0, force.y0}) {
    *entry = value;
    entry += lanes();
  }
}

void LaneStepper::step() {
  const LaneArrays arrays{q_,     v_,         q_next_,  v_next_,   scratch_, h_s_, inverse_h_Hz_,
                          force_, integrals_, momenta_, reactions_};
  if (one_chain_ != nullptr) {
    kernel_.step_one_chain(*one_chain_, arrays);
    return;
  }
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    if (!chains_[lane]) {
      continue;
    }
    if (!side_by_side_) {
      side_by_side_.emplace(*chains_[lane], lanes());
    }
    if (is_side_by_side_[lane] == 0) {
      side_by_side_->set(lane, *chains_[lane]);
      is_side_by_side_[lane] = 1;
    }
  }
  if (side_by_side_) {
    kernel_.step_chains(side_by_side_->tables(), arrays);
  }
}

ContactIntegrals<double> LaneStepper::integrals(std::size_t lane) const {
  return {integrals_[lane], integrals_[lanes() + lane], integrals_[2 * lanes() + lane]};
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
      q_next_[i] = q_[i];
      v_next_[i] = v_[i];
    }
  }
  std::swap(q_, q_next_);
  std::swap(v_, v_next_);
}

}  // namespace oblique::solver
