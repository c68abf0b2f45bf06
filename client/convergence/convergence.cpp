#include "client/convergence/convergence.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <limits>
#include <mutex>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "worker/solver/fall_cache.h"
#include "worker/solver/model/number.h"
#include "worker/solver/parallel_for.h"
#include "worker/solver/reference/chain.h"
#include "worker/solver/solve.h"
#include "worker/solver/step_choice.h"

namespace oblique::client {
namespace {

using solver::CaseResult;
using solver::fixed_number;
using Kind = ContactChange::Kind;

constexpr double kMicro = 1e6;
constexpr double kRoundingFraction = 1e-9;

Extrapolation monotone(double last, double before, double value, double highest_order) {
  const double order = std::log2(before / last);
  const double believed = std::min(order, highest_order);
  // The larger of the last difference and the difference that theory predicts for it.
  const double difference =
      std::copysign(std::max(std::abs(last), std::abs(before) * std::exp2(-highest_order)), last);
  const double correction = difference / (std::exp2(believed) - 1.0);
  return {.trend = Trend::kMonotone,
          .limit = value + correction,
          .order = order,
          .error = std::abs(correction)};
}

// Returns the times at which compression changes to restitution or back. They are the extrema of
// F_n: peak, valley, peak, ..., peak.
std::vector<double> turn_times(const CaseResult& result) {
  std::vector<double> times;
  for (std::size_t i = 0; i + 1 < result.phases.size(); ++i) {
    times.push_back(result.phases[i].t1_s);
  }
  return times;
}

// Returns start and end of each stick interval in order. If P sticks at touch or separation, that
// instant counts, so the number of times is even.
std::vector<double> stick_times(const CaseResult& result) {
  std::vector<double> times;
  for (const auto& stick : result.stick_intervals) {
    times.insert(times.end(), {stick.t0_s, stick.t1_s});
  }
  return times;
}

void add_lone(std::vector<ContactChange>& changes, const std::vector<double>& coarser,
              const std::vector<double>& finer, Kind even, Kind odd) {
  const bool in_finer = finer.size() > coarser.size();
  const auto& longer = in_finer ? finer : coarser;
  for (const std::size_t i : lone_pairs(longer, in_finer ? coarser : finer)) {
    changes.push_back({i % 2 == 0 ? even : odd, longer[i], longer[i + 1], in_finer});
  }
}

// Returns the states of `mode` ("sC sR sC sR") up to peak number `peak`, counted from 0, and the
// first state of the next restitution. With `whole_restitution`, includes its other states too.
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
  // Values of the levels after the last level that lacks the output.
  std::vector<double> tail;
  for (auto value = output.values.rbegin(); value != output.values.rend() && *value; ++value) {
    tail.insert(tail.begin(), **value);
  }
  output.extrapolation = extrapolate(tail, highest_order, kRoundingFraction * finest.scale);
  return output;
}

}  // namespace

Extrapolation extrapolate(std::span<const double> values, double highest_order, double resolution) {
  const double value = values.back();
  Extrapolation result{.trend = Trend::kTooFew, .limit = value, .order = {}, .error = {}};
  if (values.size() < 2) {
    return result;
  }
  const double last = value - values[values.size() - 2];
  result.error = std::max(std::abs(last), resolution);
  if (values.size() < 3) {
    return result;
  }
  const double before = values[values.size() - 2] - values[values.size() - 3];
  if (std::abs(last) <= resolution) {
    result.trend = Trend::kRounding;
    result.error = resolution;
  } else if (!(std::abs(last) < std::abs(before) * std::exp2(-kLeastOrder))) {
    result.trend = Trend::kUnsettled;
    result.error = std::max(std::abs(last), std::abs(before));
  } else if ((last > 0.0) != (before > 0.0)) {
    result.trend = Trend::kOscillating;
    result.error = std::max(std::abs(last), std::abs(before) * std::exp2(-highest_order));
  } else {
    result = monotone(last, before, value, highest_order);
  }
  return result;
}

std::vector<std::size_t> lone_pairs(const std::vector<double>& longer,
                                    const std::vector<double>& shorter) {
  if (longer.size() < shorter.size() || (longer.size() - shorter.size()) % 2 != 0) {
    throw std::invalid_argument("the lengths of the lists must differ by an even number");
  }
  const std::size_t columns = shorter.size() + 1;
  // cost[i * columns + j]: minimum cost of matching the first i of `longer` to j of `shorter`.
  constexpr double kNever = std::numeric_limits<double>::infinity();
  std::vector<double> cost((longer.size() + 1) * columns, kNever);
  cost[0] = 0.0;
  const auto matched = [&](std::size_t i, std::size_t j) {
    return i == 0 || j == 0
               ? kNever
               : cost[(i - 1) * columns + j - 1] + std::abs(longer[i - 1] - shorter[j - 1]);
  };
  const auto skipped = [&](std::size_t i, std::size_t j) {
    return i < 2 ? kNever : cost[(i - 2) * columns + j];
  };
  for (std::size_t i = 1; i <= longer.size(); ++i) {
    for (std::size_t j = 0; j < columns; ++j) {
      cost[i * columns + j] = std::min(matched(i, j), skipped(i, j));
    }
  }
  std::vector<std::size_t> lone;
  std::size_t i = longer.size();
  std::size_t j = shorter.size();
  while (i > 0) {
    if (matched(i, j) <= skipped(i, j)) {
      --i;
      --j;
    } else {
      i -= 2;
      lone.push_back(i);
    }
  }
  std::reverse(lone.begin(), lone.end());
  return lone;
}

std::vector<ContactChange> changes_between(const CaseResult& coarser, const CaseResult& finer) {
  std::vector<ContactChange> changes;
  add_lone(changes, turn_times(coarser), turn_times(finer), Kind::kRestitution, Kind::kCompression);
  if (changes.empty()) {
    for (std::size_t i = 0; i < coarser.peaks.size() && i < finer.peaks.size(); ++i) {
      if (coarser.peaks[i].major != finer.peaks[i].major) {
        const double t_s = finer.peaks[i].t_s;
        changes.push_back({Kind::kRipple, t_s, t_s, finer.peaks[i].major});
      }
    }
  }
  add_lone(changes, stick_times(coarser), stick_times(finer), Kind::kStick, Kind::kSlip);
  return changes;
}

const char* name_of(Kind kind) {
  constexpr const char* kNames[]{"compression", "restitution", "stick", "slip", "ripple"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string described(const ContactChange& change) {
  if (change.kind == Kind::kRipple) {
    return fmt::format(
        "a peak of F_n at {} us that is close to the limit between a ripple and a major peak",
        fixed_number(change.t0_s * kMicro, 2));
  }
  const char* cause = change.kind == Kind::kStick  ? "P's velocity grazes 0"
                      : change.kind == Kind::kSlip ? "|F_t| grazes mu F_n"
                                                   : "V_n grazes 0";
  return fmt::format("a {} of {} us, from {} to {} us ({})", name_of(change.kind),
                     solver::readable_number((change.t1_s - change.t0_s) * kMicro, 3),
                     fixed_number(change.t0_s * kMicro, 2), fixed_number(change.t1_s * kMicro, 2),
                     cause);
}

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
  for (const auto& result : results) {
    levels.push_back(outputs_of(result));
  }
  PointConvergence point;
  for (const auto& output : levels.back()) {
    point.outputs.push_back(output_convergence(output, levels, highest_order));
  }
  for (std::size_t i = 1; i < results.size(); ++i) {
    for (auto& change : changes_between(results[i - 1], results[i])) {
      change.finer_level = i;
      point.changes.push_back(change);
    }
  }
  const std::size_t n = results.size();
  point.has_one_mode = n > 2 && results[n - 2].major_mode == results[n - 1].major_mode &&
                       results[n - 3].major_mode == results[n - 1].major_mode;
  return point;
}

std::optional<double> relative_error(const std::optional<double>& value, double limit) {
  return value && limit != 0.0 ? std::optional(std::abs(*value - limit) / std::abs(limit))
                               : std::nullopt;
}

namespace {

/// Whether the tolerance controls the steps of the fall. Such a fall has no fixed step to halve.
bool falls_by_accuracy(const solver::ModelParameters& model) {
  return model.integrator == solver::Integrator::kExplicit && model.dt_fall_s == 0.0;
}

SolvedLevel solved_level(const Level& level, const ContactPoint& point, solver::FallCache& falls,
                         StatusLine& line) {
  const auto started = std::chrono::steady_clock::now();
  solver::FallOutcome fall;
  {
    const auto falling = line.begin(level.name + ": fall");
    fall = falls.fall(level.model);
  }
  if (!fall.fallen) {
    throw solver::SolveError(fall.error);
  }
  const auto touching = line.begin(level.name + ": contact");
  const solver::Finger finger(level.model, fall.fallen);
  SolvedLevel solved{level, finger.solve(point.H_m, point.mu, point.e_star)};
  solved.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  return solved;
}

}  // namespace

std::vector<Level> mesh_levels(const solver::ModelParameters& model, int coarsest, int finest) {
  std::vector<Level> levels;
  int n = coarsest;
  for (; n <= finest; n *= 2) {
    Level level{fmt::format("n = {}", n), model};
    level.model.elements_per_link = n;
    solver::validate(level.model);
    if (model.integrator == solver::Integrator::kExplicit) {
      level.model.dt_s = 0.0;
      level.model.dt_fall_s = 0.0;
    }
    levels.push_back(std::move(level));
  }
  constexpr std::size_t kFewest = 3;  // levels needed to find the order of convergence
  if (levels.size() < kFewest || n != 2 * finest) {
    throw solver::InputError(fmt::format(
        "--finest {} is not allowed: it must be 4, 8, 16, ... times the {} elements a link of "
        "the coarsest mesh",
        finest, coarsest));
  }
  return levels;
}

std::vector<Level> step_levels(const solver::ModelParameters& model, double e_star, int halvings) {
  const solver::Chain chain(model);
  const solver::StepChoice steps(chain, model);
  std::vector<Level> levels;
  for (int i = 0; i <= halvings; ++i) {
    Level level{i == 0 ? "dt" : fmt::format("dt/{:.0f}", std::exp2(i)), model};
    level.model.dt_s = std::ldexp(steps.contact(e_star).restitution_s, -i);
    if (!falls_by_accuracy(model)) {
      level.model.dt_fall_s = std::ldexp(steps.fall_s(), -i);
    }
    levels.push_back(std::move(level));
  }
  return levels;
}

std::optional<Level> exact_fall_level(const Level& level) {
  constexpr double kPart = 0.1;
  constexpr double kTightest = 1e-9;  // smallest tolerance of a model
  const double solved_for = std::min(level.model.tolerance, solver::ModelParameters().tolerance);
  if (!falls_by_accuracy(level.model) || solved_for <= kTightest) {
    return std::nullopt;
  }
  Level exact{"exact fall", level.model};
  exact.model.tolerance = std::max(kPart * solved_for, kTightest);
  return exact;
}

std::vector<SolvedLevel> solve_levels(const std::vector<Level>& levels, const ContactPoint& point,
                                      StatusLine& line,
                                      const std::function<void(const SolvedLevel&)>& after_each) {
  solver::FallCache falls;
  std::mutex reporting;
  std::vector<SolvedLevel> solved(levels.size());
  solver::parallel_for(levels.size(), levels.size(), [&](std::size_t i) {
    solved[i] = solved_level(levels[i], point, falls, line);
    const std::lock_guard lock(reporting);
    after_each(solved[i]);
  });
  return solved;
}

}  // namespace oblique::client
