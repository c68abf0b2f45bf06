#include "client/convergence/convergence.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <spdlog/fmt/fmt.h>

namespace oblique::client {
namespace {

using solver::CaseResult;

constexpr double kRoundingFraction = 1e-9;

// The states of `mode` ("sC sR sC sR") up to the peak of that number, from 0: all up to the first
// restitution after it, or up to the last one before compression starts again.
std::string mode_to_peak(const std::string& mode, std::size_t peak, bool whole_restitution) {
  std::size_t restitutions = 0;
  bool in_restitution = false;
  for (std::size_t i = 1; i < mode.size(); i += 3) {
    const bool is_restitution = mode[i] == 'R';
    if (in_restitution && !is_restitution && restitutions == peak + 1) {
      return mode.substr(0, i - 2);
    }
    restitutions += is_restitution && !in_restitution ? 1 : 0;
    in_restitution = is_restitution;
    if (restitutions == peak + 1 && !whole_restitution) {
      return mode.substr(0, i + 1);
    }
  }
  return mode;
}

std::vector<double> tail_of(const std::vector<std::optional<double>>& values) {
  std::vector<double> tail;
  for (auto value = values.rbegin(); value != values.rend() && *value; ++value) {
    tail.push_back(**value);
  }
  std::reverse(tail.begin(), tail.end());
  return tail;
}

OutputConvergence output_convergence(const Output& finest,
                                     const std::vector<std::vector<Output>>& levels,
                                     double highest_order) {
  OutputConvergence output{
      .name = finest.name, .scale = finest.scale, .values = {}, .extrapolation = {}};
  for (const auto& level : levels) {
    const auto same = std::find_if(level.begin(), level.end(), [&](const Output& other) {
      return other.name == finest.name && other.mode == finest.mode;
    });
    output.values.push_back(same == level.end() ? std::nullopt : std::optional(same->value));
  }
  output.extrapolation =
      extrapolate(tail_of(output.values), highest_order, kRoundingFraction * finest.scale);
  return output;
}

}  // namespace

std::vector<Output> outputs_of(const CaseResult& result) {
  const std::string& mode = result.major_mode;
  std::vector<Output> outputs;
  std::vector<Output> peaks;
  const double force = result.fn_peak_N;
  Output fn_peak{"fn_peak_N", result.fn_peak_N, force, mode};
  Output ft_peak{"ft_peak_N", result.ft_peak_N, force, mode};
  for (const auto& peak : result.peaks) {
    if (peak.fn_N == result.fn_peak_N) {
      fn_peak.mode = mode_to_peak(mode, peaks.size(), false);
    }
    if (peak.ft_N == result.ft_peak_N) {
      ft_peak.mode = mode_to_peak(mode, peaks.size(), true);
    }
    if (peak.major) {
      peaks.push_back({fmt::format("major_peak_{}_N", peaks.size() + 1), peak.fn_N, force,
                       mode_to_peak(mode, peaks.size(), false)});
    }
  }
  outputs.push_back(std::move(fn_peak));
  outputs.insert(outputs.end(), peaks.begin(), peaks.end());
  outputs.push_back(std::move(ft_peak));
  const double speed = std::hypot(result.vt_in_m_s, result.vn_in_m_s);
  outputs.push_back({"duration_s", result.duration_s, result.duration_s, mode});
  outputs.push_back({"stick_total_s", result.stick_total_s, result.duration_s, mode});
  outputs.push_back({"slide_m", result.slide_m, speed * result.duration_s, mode});
  outputs.push_back({"impulse_n_Ns", result.impulse_n_Ns, result.impulse_n_Ns, mode});
  outputs.push_back({"impulse_t_Ns", result.impulse_t_Ns, result.impulse_n_Ns, mode});
  outputs.push_back({"vt_out_m_s", result.vt_out_m_s, speed, mode});
  outputs.push_back({"vn_out_m_s", result.vn_out_m_s, speed, mode});
  for (std::size_t i = 0; i < result.reaction_peaks.size(); ++i) {
    outputs.push_back(
        {fmt::format("reaction_{}_N", i), result.reaction_peaks[i].force_N, force, mode});
  }
  return outputs;
}

PointConvergence convergence_of(std::span<const CaseResult> results, double highest_order) {
  std::vector<std::vector<Output>> levels;
  levels.reserve(results.size());
  for (const auto& result : results) {
    levels.push_back(outputs_of(result));
  }
  PointConvergence point;
  for (const auto& output : levels.back()) {
    point.outputs.push_back(output_convergence(output, levels, highest_order));
  }
  for (std::size_t i = 1; i < results.size(); ++i) {
    for (const auto& change : changes_between(results[i - 1], results[i])) {
      point.changes.push_back({i, change});
    }
  }
  const auto same_mode = [&](std::size_t back) {
    return results.size() > back &&
           results[results.size() - 1 - back].major_mode == results.back().major_mode;
  };
  point.has_one_mode = same_mode(1) && same_mode(2);
  return point;
}

std::optional<double> relative_error(const std::optional<double>& value, double limit) {
  if (!value || limit == 0.0) {
    return std::nullopt;
  }
  return std::abs(*value - limit) / std::abs(limit);
}

}  // namespace oblique::client
