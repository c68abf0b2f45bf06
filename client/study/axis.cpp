#include "client/study/axis.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <span>
#include <utility>

#include "client/study/nearest.h"
#include "proto/recipe/study_name.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using solver::exact_number;
using solver::InputError;
using solver::ParameterKey;

std::vector<std::string_view> all_key_names() {
  std::vector<std::string_view> names;
  for (const auto& key : solver::model_keys()) {
    names.push_back(key.name);
  }
  for (const auto& key : solver::point_keys()) {
    names.push_back(key.name);
  }
  return names;
}

const ParameterKey* find_point_key(std::string_view name) {
  const auto keys = solver::point_keys();
  const auto found = std::find_if(keys.begin(), keys.end(),
                                  [&](const ParameterKey& key) { return key.name == name; });
  return found == keys.end() ? nullptr : &*found;
}

// Place of a key in the order of a block's axes.
std::ptrdiff_t place_of(std::string_view name) {
  const auto model_keys = solver::model_keys();
  const auto* key = solver::find_model_key(name);
  return key != nullptr
             ? key - model_keys.data()
             : std::ssize(model_keys) + (find_point_key(name) - solver::point_keys().data());
}

void check_ends(const ParameterKey& key, double from, double to) {
  solver::check_value(key, from);
  solver::check_value(key, to);
  if (from > to) {
    throw InputError(std::string(key.name) + " runs from " + exact_number(from) + " to " +
                     exact_number(to) + ": a range must rise; swap `from` and `to`");
  }
}

}  // namespace

const ParameterKey& axis_key(std::string_view name) {
  const auto* key = find_point_key(name);
  if (key == nullptr) {
    key = solver::find_model_key(name);
  }
  if (key == nullptr) {
    const auto names = all_key_names();
    throw InputError("unknown key `" + std::string(name) + "`" + did_you_mean(name, names) +
                     ": the keys are " + joined(names));
  }
  return *key;
}

std::optional<double> parsed_number(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) {
    return std::nullopt;
  }
  return value;
}

protocol::Axis listed_axis(const ParameterKey& key, const std::vector<double>& values) {
  if (values.empty()) {
    throw InputError(std::string(key.name) + " = [] has no values: give at least one");
  }
  protocol::Axis axis;
  axis.set_key(std::string(key.name));
  std::set<double> seen;
  for (const double value : values) {
    solver::check_value(key, value);
    if (!seen.insert(value).second) {
      throw InputError(std::string(key.name) + " has " + exact_number(value) +
                       " twice: every value of a list must differ");
    }
    axis.add_values(value);
  }
  return axis;
}

protocol::Axis counted_axis(const ParameterKey& key, double from, double to, std::int64_t count) {
  const std::string name(key.name);
  check_ends(key, from, to);
  if (count < 1) {
    throw InputError(name + ": count = " + std::to_string(count) +
                     " is not allowed: count must be a whole number, at least 1");
  }
  if (count == 1 && from != to) {
    throw InputError(name + ": count = 1 is not allowed with two different ends, " +
                     exact_number(from) + " and " + exact_number(to) +
                     ": both ends belong to a range; give 2 or more, or the value alone");
  }
  if (count > 1 && from == to) {
    throw InputError(name + ": count = " + std::to_string(count) +
                     " is not allowed with equal ends, " + exact_number(from) +
                     ": every value would be the same; give the value alone");
  }
  protocol::Axis axis;
  axis.set_key(name);
  axis.set_from(from);
  axis.set_to(to);
  axis.set_count(static_cast<std::uint64_t>(count));
  // Every key allows an interval, or the whole numbers of one: the ends and the second value tell.
  if (count > 1) {
    solver::check_value(key, protocol::axis_value(axis, 1));
  }
  return axis;
}

protocol::Axis stepped_axis(const ParameterKey& key, double from, double to, double step) {
  const std::string name(key.name);
  check_ends(key, from, to);
  if (!(std::isfinite(step) && step > 0.0)) {
    throw InputError(name + ": step = " + exact_number(step) + " is not allowed: step must be > 0");
  }
  const double steps = (to - from) / step;
  if (steps > static_cast<double>(protocol::PointTable::kMaxPoints)) {
    throw InputError(name + ": step = " + exact_number(step) + " makes more than " +
                     std::to_string(protocol::PointTable::kMaxPoints) +
                     " values, the most that are allowed");
  }
  const double whole_steps = std::round(steps);
  // Decimal steps are not exact in binary; this is well above their rounding, relative to a step.
  const double tolerance = 1e-9 * std::max(1.0, steps);
  if (std::abs(steps - whole_steps) > tolerance) {
    const double below = from + std::floor(steps) * step;
    throw InputError(name + ": step = " + exact_number(step) + " does not lead from " +
                     exact_number(from) + " to " + exact_number(to) + ": the value after " +
                     solver::readable_number(below, 10) + " would be " +
                     solver::readable_number(below + step, 10) +
                     "; change `to` or the step, or give `count`");
  }
  return counted_axis(key, from, to, static_cast<std::int64_t>(whole_steps) + 1);
}

protocol::Block block_of(std::vector<protocol::Axis> axes) {
  for (const auto& key : solver::point_keys()) {
    const bool given = std::any_of(axes.begin(), axes.end(), [&](const protocol::Axis& axis) {
      return axis.key() == key.name;
    });
    if (!given) {
      throw InputError(std::string(key.name) + " is missing: H, mu and e must all be given (" +
                       std::string(key.name) + ": " + std::string(key.meaning) + ", " +
                       std::string(key.allowed) + ")");
    }
  }
  std::sort(axes.begin(), axes.end(), [](const protocol::Axis& a, const protocol::Axis& b) {
    return place_of(a.key()) < place_of(b.key());
  });
  protocol::Block block;
  for (auto& axis : axes) {
    *block.add_axes() = std::move(axis);
  }
  return block;
}

void check_study_name(const std::string& name) {
  if (const auto objection = protocol::objection_to_study_name(name); !objection.empty()) {
    throw InputError(objection);
  }
}

}  // namespace oblique::client
