#include "proto/recipe/written/written_axis.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/checks.h"
#include "proto/suggestion.h"
#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::protocol {
namespace {

using solver::exact_number;
using solver::InputError;

Axis axis_of(const solver::ParameterKey& key) {
  Axis axis;
  axis.set_key(std::string(key.name));
  return axis;
}

/// The index of a name in `names`. `what` begins the message about an unknown name.
int number_of_name(std::string_view name, const std::vector<std::string_view>& names,
                   std::string_view what) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    throw InputError(fmt::format("{} \"{}\" is not known{}: it must be one of {}", what,
                                 excerpt(name), did_you_mean(name, names), joined(names)));
  }
  return static_cast<int>(found - names.begin());
}

}  // namespace

Axis listed_axis(const solver::ParameterKey& key, const std::vector<double>& values,
                 BlockKind kind) {
  Axis axis = axis_of(key);
  axis.mutable_values()->Assign(values.begin(), values.end());
  check_axis(axis, kind);
  return axis;
}

void throw_wrong_count(const solver::ParameterKey& key, std::string_view written) {
  throw InputError(
      fmt::format("{}: count = {} is not allowed: count must be a whole number, at least 1",
                  key.name, written));
}

Axis counted_axis(const solver::ParameterKey& key, double from, double to, std::int64_t count,
                  Spacing spacing) {
  if (count < 1) {
    throw_wrong_count(key, std::to_string(count));
  }
  Axis axis = axis_of(key);
  axis.set_from(from);
  axis.set_to(to);
  axis.set_count(static_cast<std::uint64_t>(count));
  axis.set_spacing(spacing);
  check_axis(axis);
  return axis;
}

Axis stepped_axis(const solver::ParameterKey& key, double from, double to, double step) {
  check_ends(key, from, to);
  if (!(std::isfinite(step) && step > 0.0)) {
    throw InputError(fmt::format("{}: step = {} is not allowed: step must be > 0", key.name,
                                 exact_number(step)));
  }
  const double steps = (to - from) / step;
  if (steps > static_cast<double>(kMaxPoints)) {
    throw InputError(
        fmt::format("{}: step = {} makes more than {} values, the most that are allowed", key.name,
                    exact_number(step), kMaxPoints));
  }
  const double whole_steps = std::round(steps);
  // Decimal steps are not exact in binary. This tolerance, relative to a step, is well above their
  // rounding.
  const double tolerance = 1e-9 * std::max(1.0, steps);
  if (std::abs(steps - whole_steps) > tolerance) {
    const double below = from + std::floor(steps) * step;
    throw InputError(
        fmt::format("{}: step = {} does not lead from {} to {}: the value after {} would be {}; "
                    "change `to` or the step, or give `count`",
                    key.name, exact_number(step), exact_number(from), exact_number(to),
                    solver::readable_number(below, 10), solver::readable_number(below + step, 10)));
  }
  return counted_axis(key, from, to, static_cast<std::int64_t>(whole_steps) + 1);
}

Axis drawn_axis(const solver::ParameterKey& key, const WrittenDistribution& written,
                BlockKind kind) {
  const bool is_normal = written.kind == DISTRIBUTION_NORMAL;
  const bool has_all = is_normal ? written.mean && written.sd : written.from && written.to;
  if (!has_all || (!is_normal && (written.mean || written.sd))) {
    throw InputError(fmt::format(
        "{}: {}", key.name,
        is_normal ? "a normal distribution needs mean and sd, its standard deviation; from and to "
                    "cut it off"
                  : fmt::format("a {} distribution needs from and to, and nothing else",
                                name_of(written.kind))));
  }
  Axis axis = axis_of(key);
  Distribution& distribution = *axis.mutable_distribution();
  distribution.set_kind(written.kind);
  if (written.from) {
    distribution.set_from(*written.from);
  }
  if (written.to) {
    distribution.set_to(*written.to);
  }
  distribution.set_mean(written.mean.value_or(0.0));
  distribution.set_sd(written.sd.value_or(0.0));
  check_axis(axis, kind);
  return axis;
}

Axis expressed_axis(const solver::ParameterKey& key, std::string_view text) {
  Axis axis = axis_of(key);
  axis.set_expression(std::string(text));
  check_axis(axis);
  return axis;
}

Sample written_sample(std::string_view kind, std::int64_t count, std::int64_t seed) {
  for (const auto& [name, value, least] : {std::tuple{"count", count, 1}, {"seed", seed, 0}}) {
    if (value < least) {
      throw InputError(
          fmt::format("sample: {} = {} is not allowed: it must be a whole number, at least {}",
                      name, value, least));
    }
  }
  Sample sample;
  sample.set_kind(static_cast<SampleKind>(number_of_name(kind, sample_names(), "the sample")));
  sample.set_count(static_cast<std::uint64_t>(count));
  sample.set_seed(static_cast<std::uint64_t>(seed));
  return sample;
}

const std::vector<std::string_view>& distribution_names() {
  static const std::vector<std::string_view> names{"uniform", "log-uniform", "normal"};
  return names;
}

const std::vector<std::string_view>& sample_names() {
  static const std::vector<std::string_view> names{"random", "lhs", "sobol"};
  return names;
}

std::string_view name_of(DistributionKind kind) {
  return distribution_names().at(static_cast<std::size_t>(kind));
}

std::string_view name_of(SampleKind kind) {
  return sample_names().at(static_cast<std::size_t>(kind));
}

DistributionKind distribution_named(std::string_view name) {
  return static_cast<DistributionKind>(
      number_of_name(name, distribution_names(), "the distribution"));
}

}  // namespace oblique::protocol
