#include "proto/recipe/written/written_axis.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/checks.h"
#include "worker/solver/model/number.h"

namespace oblique::protocol {
namespace {

using solver::exact_number;
using solver::InputError;

Axis range_axis(const solver::ParameterKey& key, double from, double to, std::uint64_t count) {
  Axis axis;
  axis.set_key(std::string(key.name));
  axis.set_from(from);
  axis.set_to(to);
  axis.set_count(count);
  return axis;
}

}  // namespace

Axis listed_axis(const solver::ParameterKey& key, const std::vector<double>& values,
                 BlockKind kind) {
  Axis axis;
  axis.set_key(std::string(key.name));
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
  Axis axis = range_axis(key, from, to, static_cast<std::uint64_t>(count));
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
  // Decimal steps are not exact in binary; this is well above their rounding, relative to a step.
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

}  // namespace oblique::protocol
