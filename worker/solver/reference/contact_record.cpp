#include "worker/solver/reference/contact_record.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace oblique::solver {
namespace {

constexpr double kRippleFraction = 0.05;

}  // namespace

ContactRecord::ContactRecord(const ContactLaw& law, const TipState& touch)
    : xP_m_(law.xP_m(touch)) {
  states_.push_back({law.is_stick(), law.is_compression(), 0.0});
}

void ContactRecord::add_step(const ContactLaw& law, const TipState& start, const TipState& end,
                             const ContactIntegrals<double>& integrals) {
  impulse_n_Ns_ += integrals.impulse_n;
  impulse_t_Ns_ += integrals.impulse_t;
  work_t_J_ += integrals.work_t;
  // F_n is affine in y between events, so its work is exact.
  const double work_n = 0.5 * (law.fn_N(start) + law.fn_N(end)) * (end.y_m - start.y_m);
  work_n_J_ += work_n;
  exchanged_J_ += std::abs(work_n) + std::abs(integrals.work_t);
  ft_span_N_ = std::max(ft_span_N_, std::abs(law.ft_N(end)));
  ft_largest_N_ = std::max(ft_largest_N_, std::abs(law.ft_N(end)));
}

void ContactRecord::add_turn(const ContactLaw& before, const TipState& tip, double t_s) {
  if (before.is_compression()) {
    turns_.push_back({t_s, before.fn_N(tip), 0.0});
  } else {
    turns_.back().ft_span_N = ft_span_N_;
    ft_span_N_ = std::abs(before.ft_N(tip));
    turns_.push_back({t_s, before.fn_N(tip), 0.0});
  }
}

void ContactRecord::add_tangential_peak(double ft_N, double t_s) {
  ft_peaks_.push_back({t_s, std::abs(ft_N)});
}

void ContactRecord::close_slide(const ContactLaw& law, const TipState& tip) {
  const double xP = law.xP_m(tip);
  if (!states_.back().stick) {
    slide_m_ += std::abs(xP - xP_m_);
  }
  xP_m_ = xP;
}

void ContactRecord::add_state(const ContactLaw& law, const TipState& tip, double t_s) {
  close_slide(law, tip);
  if (states_.back().t0_s == t_s) {
    states_.pop_back();
  }
  const bool is_new = states_.empty() || states_.back().stick != law.is_stick() ||
                      states_.back().compression != law.is_compression();
  if (is_new) {
    states_.push_back({law.is_stick(), law.is_compression(), t_s});
  }
}

void ContactRecord::finish(const ContactLaw& law, const TipState& tip, double t_s) {
  close_slide(law, tip);
  if (states_.back().t0_s == t_s) {
    states_.pop_back();  // as where both forces vanish together, and rounding lets P slip first
  }
  turns_.back().ft_span_N = ft_span_N_;
  duration_s_ = t_s;
}

std::vector<bool> without_ripples(const std::vector<double>& fn_N) {
  std::vector<bool> survives(fn_N.size(), true);
  const double threshold =
      fn_N.empty() ? 0.0 : kRippleFraction * *std::max_element(fn_N.begin(), fn_N.end());
  for (;;) {
    std::size_t left = fn_N.size();
    std::size_t best_left = fn_N.size();
    std::size_t best_right = fn_N.size();
    double shallowest = threshold;
    for (std::size_t i = 0; i < fn_N.size(); ++i) {
      if (!survives[i]) {
        continue;
      }
      if (left < fn_N.size() && std::abs(fn_N[i] - fn_N[left]) < shallowest) {
        shallowest = std::abs(fn_N[i] - fn_N[left]);
        best_left = left;
        best_right = i;
      }
      left = i;
    }
    if (best_left == fn_N.size()) {
      return survives;
    }
    survives[best_left] = false;
    survives[best_right] = false;
  }
}

std::vector<bool> ContactRecord::surviving_turns() const {
  std::vector<double> forces;
  for (const Turn& turn : turns_) {
    forces.push_back(turn.fn_N);
  }
  return without_ripples(forces);
}

std::string ContactRecord::mode(const std::vector<bool>& survives) const {
  std::string text;
  std::string last;
  for (const State& state : states_) {
    // A state lies between two turns; its kind is the parity of the surviving turns before it.
    bool compression = true;
    for (std::size_t i = 0; i < turns_.size() && turns_[i].t_s <= state.t0_s; ++i) {
      compression = survives[i] ? !compression : compression;
    }
    const std::string name = {state.stick ? 'S' : 's', compression ? 'C' : 'R'};
    if (name != last) {
      text += (text.empty() ? "" : " ") + name;
    }
    last = name;
  }
  return text;
}

void ContactRecord::write_to(CaseResult& result) const {
  const auto survives = surviving_turns();
  result.mode = mode(std::vector<bool>(turns_.size(), true));
  result.major_mode = mode(survives);
  result.duration_s = duration_s_;
  result.slide_m = slide_m_;
  result.impulse_n_Ns = impulse_n_Ns_;
  result.impulse_t_Ns = impulse_t_Ns_;
  result.ft_peaks = ft_peaks_;
  result.ft_peak_N = ft_largest_N_;
  result.fn_peak_N = 0.0;
  double phase_start_s = 0.0;
  for (std::size_t i = 0; i < turns_.size(); ++i) {
    const bool is_peak = i % 2 == 0;
    if (is_peak) {
      result.peaks.push_back({turns_[i].t_s, turns_[i].fn_N, turns_[i].ft_span_N, survives[i]});
      result.fn_peak_N = std::max(result.fn_peak_N, turns_[i].fn_N);
    }
    result.phases.push_back({is_peak ? PhaseKind::kCompression : PhaseKind::kRestitution,
                             phase_start_s, turns_[i].t_s, turns_[i].fn_N});
    phase_start_s = turns_[i].t_s;
  }
  result.phases.push_back({PhaseKind::kRestitution, phase_start_s, duration_s_, 0.0});
  result.stick_total_s = 0.0;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    if (!states_[i].stick) {
      continue;
    }
    const double t0_s = states_[i].t0_s;
    while (i + 1 < states_.size() && states_[i + 1].stick) {
      ++i;
    }
    const double t1_s = i + 1 < states_.size() ? states_[i + 1].t0_s : duration_s_;
    result.stick_intervals.push_back({t0_s, t1_s});
    result.stick_total_s += t1_s - t0_s;
  }
  result.energy.exchanged_J = exchanged_J_;
  result.energy.friction_J = -work_t_J_;
  result.energy.restitution_J = -work_n_J_;
}

}  // namespace oblique::solver
