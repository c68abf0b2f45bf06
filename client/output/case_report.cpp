#include "client/output/case_report.h"

#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/output/printer.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using nlohmann::ordered_json;
using solver::CaseResult;
using solver::exact_number;
using solver::fixed_number;
using solver::readable_number;

constexpr double kMicro = 1e6;
constexpr double kMilli = 1e3;

const char* kind_name(solver::PhaseKind kind) {
  return kind == solver::PhaseKind::kCompression ? "compression" : "restitution";
}

ordered_json json_of(const solver::ContactEnergy& energy) {
  return {
      {"kinetic_in_J", energy.kinetic_in_J},       {"friction_J", energy.friction_J},
      {"restitution_J", energy.restitution_J},     {"kinetic_change_J", energy.kinetic_change_J},
      {"strain_change_J", energy.strain_change_J}, {"gravity_change_J", energy.gravity_change_J},
      {"exchanged_J", energy.exchanged_J},         {"closure", energy.closure}};
}

ordered_json json_of(const solver::SolverReport& report) {
  return {{"integrator", report.integrator},
          {"dt_s", report.dt_s},
          {"steps", report.steps},
          {"wall_s", report.wall_s},
          {"version", report.version}};
}

ordered_json json_of(const std::vector<solver::ReactionPeak>& peaks) {
  ordered_json all = ordered_json::array();
  for (const auto& peak : peaks) {
    all.push_back({{"t_s", peak.t_s}, {"force_N", peak.force_N}});
  }
  return all;
}

void print_peaks(std::ostream& out, const CaseResult& result) {
  out << "peaks         t [us]    F_n [N]  largest |F_t| around it [N]\n";
  for (const auto& peak : result.peaks) {
    out << fmt::format("            {:>8}  {:>9}  {:>9}{}\n", fixed_number(peak.t_s * kMicro, 2),
                       fixed_number(peak.fn_N, 2), fixed_number(peak.ft_N, 2),
                       peak.major ? "" : "  ripple");
  }
  out << fmt::format("largest               {:>9}  {:>9}\n", fixed_number(result.fn_peak_N, 2),
                     fixed_number(result.ft_peak_N, 2));
}

void print_span(std::ostream& out, const char* name, double t0_s, double t1_s) {
  out << fmt::format("{:<11}  {:>8} {:>8}  {:>12}\n", name, fixed_number(t0_s * kMicro, 2),
                     fixed_number(t1_s * kMicro, 2), fixed_number((t1_s - t0_s) * kMicro, 2));
}

void print_spans(std::ostream& out, const CaseResult& result) {
  out << "\nphases      from [us]  to [us]  lasting [us]\n";
  for (const auto& phase : result.phases) {
    print_span(out, kind_name(phase.kind), phase.t0_s, phase.t1_s);
  }
  for (const auto& stick : result.stick_intervals) {
    print_span(out, "stick", stick.t0_s, stick.t1_s);
  }
}

void print_reactions(std::ostream& out, const std::vector<solver::ReactionPeak>& peaks) {
  if (!peaks.empty()) {
    out << "\nreactions     t [us]  largest [N]\n";
  }
  for (std::size_t i = 0; i < peaks.size(); ++i) {
    out << fmt::format("{:<11} {:>8}  {:>11}\n", i == 0 ? "pin O" : "joint " + std::to_string(i),
                       fixed_number(peaks[i].t_s * kMicro, 2), fixed_number(peaks[i].force_N, 2));
  }
}

}  // namespace

ordered_json json_of(const CaseResult& result) {
  ordered_json fn_peaks = ordered_json::array();
  ordered_json major_peaks = ordered_json::array();
  for (const auto& peak : result.peaks) {
    fn_peaks.push_back(peak.fn_N);
    if (peak.major) {
      major_peaks.push_back(peak.fn_N);
    }
  }
  ordered_json ft_peaks = ordered_json::array();
  for (const auto& peak : result.ft_peaks) {
    ft_peaks.push_back(peak.ft_N);
  }
  ordered_json sticks = ordered_json::array();
  for (const auto& stick : result.stick_intervals) {
    sticks.push_back({stick.t0_s, stick.t1_s});
  }
  ordered_json phases = ordered_json::array();
  for (const auto& phase : result.phases) {
    phases.push_back({{"kind", kind_name(phase.kind)}, {"t0_s", phase.t0_s}, {"t1_s", phase.t1_s}});
  }
  return {{"H", result.H_m},
          {"mu", result.mu},
          {"e", result.e_star},
          {"fall_time_s", result.fall_time_s},
          {"impact_x_m", result.impact_x_m},
          {"vt_in_m_s", result.vt_in_m_s},
          {"vn_in_m_s", result.vn_in_m_s},
          {"duration_s", result.duration_s},
          {"fn_peak_N", result.fn_peak_N},
          {"ft_peak_N", result.ft_peak_N},
          {"fn_peaks_N", fn_peaks},
          {"ft_peaks_N", ft_peaks},
          {"major_peaks_N", major_peaks},
          {"impulse_n_Ns", result.impulse_n_Ns},
          {"impulse_t_Ns", result.impulse_t_Ns},
          {"slide_m", result.slide_m},
          {"vt_out_m_s", result.vt_out_m_s},
          {"vn_out_m_s", result.vn_out_m_s},
          {"mode", result.mode},
          {"major_mode", result.major_mode},
          {"stick_total_s", result.stick_total_s},
          {"stick_intervals_s", sticks},
          {"phases", phases},
          {"reaction_peaks", json_of(result.reaction_peaks)},
          {"energy", json_of(result.energy)},
          {"solver", json_of(result.solver)}};
}

void print_summary(std::ostream& out, const CaseResult& result) {
  out << fmt::format("H = {} m, mu = {}, e* = {}\n", exact_number(result.H_m),
                     exact_number(result.mu), exact_number(result.e_star))
      << fmt::format("fall        {} s; the tip lands at x = {} m with V_t = {}, V_n = {} m/s\n",
                     fixed_number(result.fall_time_s, 6), fixed_number(result.impact_x_m, 5),
                     fixed_number(result.vt_in_m_s, 4), fixed_number(result.vn_in_m_s, 4))
      << fmt::format("contact     {} us, leaving with V_t = {}, V_n = {} m/s\n",
                     fixed_number(result.duration_s * kMicro, 2),
                     fixed_number(result.vt_out_m_s, 4), fixed_number(result.vn_out_m_s, 4))
      << "mode        " << result.major_mode;
  if (result.mode != result.major_mode) {
    out << "  (with ripples: " << result.mode << ')';
  }
  out << "\n\n";
  print_peaks(out, result);
  print_spans(out, result);
  print_reactions(out, result.reaction_peaks);
  const auto& energy = result.energy;
  const auto& report = result.solver;
  out << fmt::format("\nslide       P slides {} mm along the ground\n",
                     fixed_number(result.slide_m * kMilli, 5))
      << fmt::format("impulses    normal {}, tangential {} N s\n",
                     fixed_number(result.impulse_n_Ns, 6), fixed_number(result.impulse_t_Ns, 6))
      << fmt::format("energy      {} J in; friction takes {} J, restitution {} J; closure {}\n",
                     fixed_number(energy.kinetic_in_J, 4), fixed_number(energy.friction_J, 6),
                     fixed_number(energy.restitution_J, 6), readable_number(energy.closure, 2))
      << fmt::format("solver      {} {}, {} steps of {} us, {} ms\n", report.integrator,
                     report.version, report.steps, readable_number(report.dt_s * kMicro, 3),
                     readable_number(report.wall_s * kMilli, 2));
}

}  // namespace oblique::client
