#include "tests/validation/outputs.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace oblique::validation {
namespace {

using solver::CaseResult;
using Values = std::vector<double>;

double largest_fn(const CaseResult& r, double) {
  return r.fn_peak_N;
}
double largest_ft(const CaseResult& r, double) {
  return r.ft_peak_N;
}
double duration(const CaseResult& r, double) {
  return r.duration_s;
}
double normal_impulse(const CaseResult& r, double) {
  return r.impulse_n_Ns;
}
double speed_at_touch(const CaseResult& r, double) {
  return std::hypot(r.vt_in_m_s, r.vn_in_m_s);
}
double speed_at_exit(const CaseResult& r, double) {
  return std::hypot(r.vt_out_m_s, r.vn_out_m_s);
}
double exchanged_work(const CaseResult& r, double) {
  return r.energy.exchanged_J;
}
double itself(const CaseResult&, double value) {
  return std::abs(value);
}

Values normal_peaks(const CaseResult& r) {
  Values values;
  for (const auto& peak : r.peaks) {
    values.push_back(peak.fn_N);
  }
  return values;
}

Values tangential_peaks(const CaseResult& r) {
  Values values;
  for (const auto& peak : r.ft_peaks) {
    values.push_back(peak.ft_N);
  }
  return values;
}

/// All ends of phases but the last, which is the duration.
Values turns(const CaseResult& r) {
  Values values;
  for (const auto& phase : r.phases) {
    values.push_back(phase.t1_s);
  }
  values.pop_back();
  return values;
}

Values stick_ends(const CaseResult& r) {
  Values values;
  for (const auto& interval : r.stick_intervals) {
    values.push_back(interval.t0_s);
    values.push_back(interval.t1_s);
  }
  return values;
}

Values exit_velocity(const CaseResult& r) {
  return {r.vt_out_m_s, r.vn_out_m_s};
}

Values reactions(const CaseResult& r) {
  Values values;
  for (const auto& peak : r.reaction_peaks) {
    values.push_back(peak.force_N);
  }
  return values;
}

}  // namespace

std::vector<Output> outputs() {
  return {
      {"largest F_n", "itself", [](const CaseResult& r) { return Values{r.fn_peak_N}; }, itself,
       true},
      {"largest F_t", "itself", [](const CaseResult& r) { return Values{r.ft_peak_N}; }, itself,
       true},
      {"duration", "itself", [](const CaseResult& r) { return Values{r.duration_s}; }, itself,
       true},
      {"slide of P", "itself", [](const CaseResult& r) { return Values{r.slide_m}; }, itself, true},
      {"stick, total", "duration", [](const CaseResult& r) { return Values{r.stick_total_s}; },
       duration, true},
      {"impulses", "normal impulse",
       [](const CaseResult& r) {
         return Values{r.impulse_n_Ns, r.impulse_t_Ns};
       },
       normal_impulse, true},
      {"friction and restitution losses", "exchanged work",
       [](const CaseResult& r) {
         return Values{r.energy.friction_J, r.energy.restitution_J};
       },
       exchanged_work, true},
      {"exit velocity", "speed at touch", exit_velocity, speed_at_touch, true},
      {"exit velocity", "exit speed", exit_velocity, speed_at_exit, true},
      {"reaction peaks", "each itself", reactions, itself, true},
      {"all peaks of F_n", "largest F_n", normal_peaks, largest_fn, false},
      {"all peaks of F_n", "each itself", normal_peaks, itself, false},
      {"all peaks of F_t", "largest F_t", tangential_peaks, largest_ft, false},
      {"instants of turns", "duration", turns, duration, false},
      {"ends of stick", "duration", stick_ends, duration, false},
  };
}

double difference(const Output& output, const std::vector<double>& values,
                  const solver::CaseResult& right) {
  const Values expected = output.values(right);
  double largest = 0.0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const double missing = std::abs(values.at(i) - expected[i]);
    if (missing != 0.0) {
      largest = std::max(largest, missing / output.scale(right, expected[i]));
    }
  }
  return largest;
}

bool have_same_turns(const solver::CaseResult& a, const solver::CaseResult& b) {
  return a.mode == b.mode && a.phases.size() == b.phases.size() &&
         a.ft_peaks.size() == b.ft_peaks.size();
}

}  // namespace oblique::validation
