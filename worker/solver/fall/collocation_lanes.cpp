#include "worker/solver/fall/collocation_lanes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "worker/solver/fall/front_kernel.h"

namespace oblique::solver {
namespace {

/// After so many iterations the step is taken to be too long.
constexpr int kMostIterations = 10;
/// Corrections that no longer shrink are rounding when they are below this many errors allowed.
constexpr double kRoundingErrors = 1000.0;

using Constants = ElementConstants<double>;

Constants element_constants(double length_m, const ModelParameters& model) {
  const double l = length_m;
  const double kg = model.rho_kg_m3 * model.A_m2 * l;
  return {1.0 / l,          model.E_Pa * model.A_m2 * l, 2.0 * model.E_Pa * model.I_m4 / l,
          kg * 13.0 / 35.0, kg * l * 11.0 / 210.0,       kg * l * l / 105.0,
          kg * 9.0 / 70.0,  kg * l * 13.0 / 420.0,       kg * l * l / 140.0};
}

template <class Item>
constexpr std::size_t numbers_of() {
  return sizeof(Item) / sizeof(double);
}

}  // namespace

CollocationLanes::CollocationLanes(const CollocationKernel& kernel, const GaussCollocation& rule,
                                   const Chain& chain, const ModelParameters& model)
    : kernel_(kernel),
      size_(2 * static_cast<std::size_t>(chain.rows())),
      chains_(chain.tables(), kernel.lanes),
      total_kg_(kernel.lanes) {
  const std::size_t links = chain.links();
  const std::size_t elements = links * chain.tables().elements_per_link;
  const std::size_t stages = kernel.stages;
  const std::size_t pairs = GaussCollocation::pairs_of(stages);
  std::vector<std::pair<double**, std::size_t>> parts{
      {&elements_, links * numbers_of<Constants>()},
      {&tip_mass_kg_, 1},
      {&mass_kg_, size_ / 2},
      {&h_s_, 1},
      {&active_, 1},
      {&state_, 3 * size_},
      {&next_, 3 * size_},
      {&arrays_.stage_q, stages * size_},
      {&arrays_.stage_a, stages * size_},
      {&arrays_.work, 2 * pairs * size_},
      {&arrays_.tangents, elements * numbers_of<TangentBlocks<double>>()},
      {&arrays_.fronts, pairs * elements * numbers_of<ElementFront<double>>()},
      {&arrays_.ends, pairs * links * numbers_of<EndFront<double>>()},
      {&arrays_.squares, 1}};
  // Every part begins on a line, whatever the number of lanes.
  constexpr std::size_t kLine = numbers_of<Line>();
  const auto lines = [&](std::size_t count) { return (count * lanes() + kLine - 1) / kLine; };
  std::size_t total = 0;
  for (const auto& [start, count] : parts) {
    total += lines(count);
  }
  memory_.assign(total, Line{});
  Line* next = memory_.data();
  for (const auto& [start, count] : parts) {
    *start = next->numbers;
    next += lines(count);
  }
  arrays_.rule = &rule;
  arrays_.chain = chains_.tables();
  arrays_.elements = elements_;
  arrays_.tip_mass_kg = tip_mass_kg_;
  arrays_.mass_kg = mass_kg_;
  arrays_.h_s = h_s_;
  arrays_.active = active_;
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    load(lane, chain, model);
  }
}

void CollocationLanes::load(std::size_t lane, const Chain& chain, const ModelParameters& model) {
  set_constants(lane, chain, model);
  const ChainState rest = chain.at_rest();
  const std::vector<double> none(size_, 0.0);
  set_state(lane, rest.q.data(), rest.v.data(), none.data());
}

void CollocationLanes::set_constants(std::size_t lane, const Chain& chain,
                                     const ModelParameters& model) {
  chains_.set(lane, chain.tables());
  std::vector<double> kg(size_ / 2, 0.0);
  const auto n = static_cast<std::size_t>(model.elements_per_link);
  std::size_t row = 0;
  for (std::size_t link = 0; link < chain.links(); ++link) {
    const Constants constants =
        element_constants(model.lengths_m[link] / static_cast<double>(n), model);
    const auto* number = reinterpret_cast<const double*>(&constants);
    for (std::size_t i = 0; i < numbers_of<Constants>(); ++i) {
      elements_[(link * numbers_of<Constants>() + i) * lanes() + lane] = number[i];
    }
    for (std::size_t e = 1; e <= n; ++e) {
      const bool ends_at_joint = e == n && link + 1 < chain.links();
      const std::size_t p_row = row + (ends_at_joint ? 3 : 2);
      const std::size_t s_row = row + (ends_at_joint ? 2 : 3);
      kg[row] += constants.m_pp;
      kg[row + 1] += constants.m_ss;
      kg[p_row] += constants.m_pp;
      kg[s_row] += constants.m_ss;
      row = p_row;
    }
  }
  kg[row] += model.tip_mass_kg;
  for (std::size_t i = 0; i < kg.size(); ++i) {
    mass_kg_[i * lanes() + lane] = kg[i];
  }
  tip_mass_kg_[lane] = model.tip_mass_kg;
  double length_m = 0.0;
  for (const double link_m : model.lengths_m) {
    length_m += link_m;
  }
  total_kg_[lane] = model.rho_kg_m3 * model.A_m2 * length_m + model.tip_mass_kg;
}

void CollocationLanes::set_state(std::size_t lane, const double* q, const double* v,
                                 const double* mean) {
  double* to = state_ + lane;
  for (const double* from : {q, v, mean}) {
    for (std::size_t i = 0; i < size_; ++i) {
      *to = from[i];
      to += lanes();
    }
  }
}

void CollocationLanes::attempt(std::span<const double> h_s, std::span<const double> error_m,
                               std::span<Attempt> attempts) {
  const std::size_t vector = size_ * lanes();
  arrays_.q = state_;
  arrays_.v = state_ + vector;
  arrays_.mean = state_ + 2 * vector;
  arrays_.q_next = next_;
  arrays_.v_next = next_ + vector;
  arrays_.mean_next = next_ + 2 * vector;
  std::vector<double> before_m(lanes(), 0.0);
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    h_s_[lane] = h_s[lane];
    active_[lane] = h_s[lane] > 0.0 ? 1.0 : 0.0;
    attempts[lane] = {};
  }
  const auto any_is_active = [this] {
    return std::any_of(active_, active_ + lanes(), [](double active) { return active != 0.0; });
  };
  kernel_.prepare(arrays_);
  for (int iteration = 1; any_is_active(); ++iteration) {
    kernel_.iterate(arrays_);
    for (std::size_t lane = 0; lane < lanes(); ++lane) {
      if (active_[lane] == 0.0) {
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
        active_[lane] = 0.0;
      }
      before_m[lane] = size_m;
    }
  }
  kernel_.finish(arrays_);
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    attempts[lane].unresolved_m_s = std::sqrt(arrays_.squares[lane] / total_kg_[lane]);
  }
}

void CollocationLanes::settle(std::span<const unsigned char> accept) {
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    if (accept[lane] == 0) {
      for (std::size_t i = lane; i < 3 * size_ * lanes(); i += lanes()) {
        next_[i] = state_[i];
      }
    }
  }
  std::swap(state_, next_);
}

void CollocationLanes::copy_state(std::size_t lane, double* q_v_mean) const {
  for (std::size_t i = 0; i < 3 * size_; ++i) {
    q_v_mean[i] = state_[i * lanes() + lane];
  }
}

void CollocationLanes::copy_stages(std::size_t lane, double* accelerations) const {
  for (std::size_t i = 0; i < kernel_.stages * size_; ++i) {
    accelerations[i] = arrays_.stage_a[i * lanes() + lane];
  }
}

}  // namespace oblique::solver
