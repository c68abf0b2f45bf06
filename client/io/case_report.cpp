#include "client/io/case_report.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/io/row_output.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::client {
namespace {

using nlohmann::ordered_json;
using solver::CaseResult;
using solver::exact_number;
using solver::fixed_number;
using solver::readable_number;

constexpr double kMicro = 1e6;
constexpr double kMilli = 1e3;
/// If the margin of a mode is smaller, a change in the fifth digit of H, mu or e* changes the mode
/// (worker/solver/reference/theory.md).
constexpr double kDoubtfulMargin = 1e-4;

ordered_json json_of(const solver::Cell& cell) {
  return std::visit([](const auto& value) { return ordered_json(value); }, cell);
}

ordered_json json_of(const solver::ResultList& list, std::span<const solver::Cell> element) {
  ordered_json json = list.has_names ? ordered_json::object() : ordered_json::array();
  for (std::size_t i = 0; i < element.size(); ++i) {
    if (list.has_names) {
      json[std::string(list.members[i])] = json_of(element[i]);
    } else {
      json.push_back(json_of(element[i]));
    }
  }
  return json;
}

ordered_json json_of(const CaseResult& result, const solver::ListPart& part) {
  const auto number_of = [&](std::string_view member) {
    const auto& members = part.list->members;
    return static_cast<std::size_t>(std::ranges::find(members, member) - members.begin());
  };
  ordered_json list = ordered_json::array();
  part.list->each(result, [&](std::span<const solver::Cell> element) {
    if (!part.where.empty() && !std::get<bool>(element[number_of(part.where)])) {
      return;
    }
    list.push_back(part.member.empty() ? json_of(*part.list, element)
                                       : json_of(element[number_of(part.member)]));
  });
  return list;
}

template <class T>
ordered_json json_of(const CaseResult& result, const solver::Member<T>& member) {
  const T* value = member.of(result);
  return value == nullptr ? ordered_json(nullptr) : ordered_json(*value);
}

std::string microseconds(double time_s) {
  return fixed_number(time_s * kMicro, 2);
}

void print_peaks(std::ostream& out, const CaseResult& result) {
  out << "peaks         t [us]    F_n [N]  largest |F_t| around it [N]\n";
  for (const auto& peak : result.peaks) {
    out << fmt::format("            {:>8}  {:>9}  {:>9}{}\n", microseconds(peak.t_s),
                       fixed_number(peak.fn_N, 2), fixed_number(peak.ft_N, 2),
                       peak.major ? "" : "  ripple");
  }
  out << fmt::format("largest               {:>9}  {:>9}\n", fixed_number(result.fn_peak_N, 2),
                     fixed_number(result.ft_peak_N, 2));
}

void print_spans(std::ostream& out, const CaseResult& result) {
  const auto print_span = [&out](std::string_view name, double t0_s, double t1_s) {
    out << fmt::format("{:<11}  {:>8} {:>8}  {:>12}\n", name, microseconds(t0_s),
                       microseconds(t1_s), microseconds(t1_s - t0_s));
  };
  out << "\nphases      from [us]  to [us]  lasting [us]\n";
  for (const auto& phase : result.phases) {
    print_span(phase_kind_name(phase.kind), phase.t0_s, phase.t1_s);
  }
  for (const auto& stick : result.stick_intervals) {
    print_span("stick", stick.t0_s, stick.t1_s);
  }
}

void print_reactions(std::ostream& out, const std::vector<solver::ReactionPeak>& peaks) {
  out << (peaks.empty() ? "" : "\nreactions     t [us]  largest [N]\n");
  for (std::size_t i = 0; i < peaks.size(); ++i) {
    out << fmt::format("{:<11} {:>8}  {:>11}\n", i == 0 ? "pin O" : fmt::format("joint {}", i),
                       microseconds(peaks[i].t_s), fixed_number(peaks[i].force_N, 2));
  }
}

/// Prints each estimated error in percent of the output's scale (worker/solver/accuracy.md).
void print_errors(std::ostream& out, const solver::ErrorEstimate& errors) {
  if (!errors.mode_same) {
    return;
  }
  const std::array<std::pair<const char*, std::optional<double>>, 8> named{
      {{"F_n", errors.fn_peak},
       {"F_t", errors.ft_peak},
       {"contact", errors.duration},
       {"stick", errors.stick_total},
       {"slide", errors.slide},
       {"impulses", errors.impulse_n},
       {"tangential", errors.impulse_t},
       {"exit velocity", errors.v_out}}};
  out << "errors      estimated [%]:";
  const char* separator = " ";
  for (const auto& [name, error] : named) {
    out << separator << name << ' ' << (error ? readable_number(100.0 * *error, 2) : "-");
    separator = ", ";
  }
  out << (*errors.mode_same == 1 ? "; the same mode" : "; another mode") << " on half the mesh\n";
}

}  // namespace

ordered_json json_of(const CaseResult& result) {
  ordered_json json{{"H", result.H_m}, {"mu", result.mu}, {"e", result.e_star}};
  for (const auto& field : solver::result_fields()) {
    auto& object = field.group.empty() ? json : json[std::string(field.group)];
    object[std::string(field.name)] =
        std::visit([&](const auto& value) { return json_of(result, value); }, field.value);
  }
  return json;
}

void print_summary(std::ostream& out, const CaseResult& result) {
  out << fmt::format("H = {} m, mu = {}, e* = {}\n", exact_number(result.H_m),
                     exact_number(result.mu), exact_number(result.e_star))
      << fmt::format("fall        {} s; the tip lands at x = {} m\n",
                     fixed_number(result.fall_time_s, 6), fixed_number(result.impact_x_m, 5))
      << fmt::format("            with V_t = {}, V_n = {} m/s\n", fixed_number(result.vt_in_m_s, 4),
                     fixed_number(result.vn_in_m_s, 4))
      << fmt::format("contact     {} us, leaving with V_t = {}, V_n = {} m/s\n",
                     microseconds(result.duration_s), fixed_number(result.vt_out_m_s, 4),
                     fixed_number(result.vn_out_m_s, 4))
      << fmt::format("mode        {}{}\n            ({})\n", result.major_mode,
                     result.mode == result.major_mode
                         ? ""
                         : fmt::format("  (with ripples: {})", result.mode),
                     kModeLetters);
  if (result.margin && result.margin_event) {
    out << fmt::format("margin      {} (0 fragile, 1 safe), closest event: {}{}\n",
                       readable_number(*result.margin, 2), *result.margin_event,
                       *result.margin < kDoubtfulMargin ? "; the mode is not reliable" : "");
  }
  out << '\n';
  print_peaks(out, result);
  print_spans(out, result);
  print_reactions(out, result.reaction_peaks);
  const auto& energy = result.energy;
  const auto& report = result.solver;
  out << '\n';
  print_errors(out, result.errors);
  out << fmt::format("slide       P slides {} mm along the ground\n",
                     fixed_number(result.slide_m * kMilli, 5))
      << fmt::format("impulses    normal {}, tangential {} N s\n",
                     fixed_number(result.impulse_n_Ns, 6), fixed_number(result.impulse_t_Ns, 6))
      << fmt::format("energy      {} J in; friction takes {} J, restitution {} J\n",
                     fixed_number(energy.kinetic_in_J, 4), fixed_number(energy.friction_J, 6),
                     fixed_number(energy.restitution_J, 6))
      << fmt::format("            balance error {} of the exchanged energy\n",
                     readable_number(energy.closure, 2))
      << fmt::format("solver      {} {}, {} steps of {} us, {} ms\n", report.integrator,
                     report.version, report.steps, readable_number(report.dt_s * kMicro, 3),
                     readable_number(report.wall_s * kMilli, 2));
}

}  // namespace oblique::client
