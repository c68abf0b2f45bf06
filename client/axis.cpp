#include "client/axis.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <set>
#include <span>
#include <utility>

#include "client/nearest.h"
#include "worker/solver/solve.h"

namespace oblique::client {
namespace {

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
std::size_t place_of(std::string_view name) {
  const auto names = all_key_names();
  return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
}

void check_ends(const ParameterKey& key, double from, double to) {
  solver::check_value(key, from);
  solver::check_value(key, to);
  if (from > to) {
    throw InputError(std::string(key.name) + " runs from " + shown_number(from) + " to " +
                     shown_number(to) + ": a range must rise; swap `from` and `to`");
  }
}

// A fall depends on these keys alone; models that differ elsewhere share one.
solver::ModelParameters fall_of(solver::ModelParameters model) {
  const solver::ModelParameters defaults;
  model.k_N_m = defaults.k_N_m;
  model.eta2 = defaults.eta2;
  model.dt_s = defaults.dt_s;
  return model;
}

double largest_H_m(const protocol::Block& block) {
  const auto& axis = *std::find_if(block.axes().begin(), block.axes().end(),
                                   [](const protocol::Axis& a) { return a.key() == "H"; });
  return axis.count() > 0 ? axis.to()
                          : *std::max_element(axis.values().begin(), axis.values().end());
}

// The distinct falls of a block's models; empty when there are too many to solve beforehand.
std::vector<solver::ModelParameters> falls_of_block(const protocol::PointTable& table, int block) {
  constexpr std::uint64_t kMostModels = 8;
  if (table.models() > kMostModels) {
    return {};
  }
  std::vector<solver::ModelParameters> falls;
  std::uint64_t first = 0;
  for (int b = 0; b <= block; ++b) {
    std::uint64_t points = 1;
    for (const auto& axis : table.recipe().blocks(b).axes()) {
      points *= protocol::axis_size(axis);
    }
    for (std::uint64_t at = first; b == block && at < first + points;) {
      const auto segment = table.segment_at(at);
      const auto fall = fall_of(table.model(segment.model));
      if (std::find(falls.begin(), falls.end(), fall) == falls.end()) {
        falls.push_back(fall);
      }
      at = segment.first_point + segment.count;
    }
    first += points;
  }
  return falls;
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

std::string shown_number(double value) {
  char text[32];
  const int length = std::snprintf(text, sizeof text, "%.10g", value);
  return {text, static_cast<std::size_t>(length)};
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
      throw InputError(std::string(key.name) + " has " + shown_number(value) +
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
                     shown_number(from) + " and " + shown_number(to) +
                     ": both ends belong to a range; give 2 or more, or the value alone");
  }
  if (count > 1 && from == to) {
    throw InputError(name + ": count = " + std::to_string(count) +
                     " is not allowed with equal ends, " + shown_number(from) +
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
    throw InputError(name + ": step = " + shown_number(step) + " is not allowed: step must be > 0");
  }
  const double steps = (to - from) / step;
  if (steps > static_cast<double>(protocol::PointTable::kMaxPoints)) {
    throw InputError(name + ": step = " + shown_number(step) + " makes more than " +
                     std::to_string(protocol::PointTable::kMaxPoints) +
                     " values, the most that are allowed");
  }
  const double whole_steps = std::round(steps);
  // Decimal steps are not exact in binary; this is well above their rounding, relative to a step.
  const double tolerance = 1e-9 * std::max(1.0, steps);
  if (std::abs(steps - whole_steps) > tolerance) {
    const double below = from + std::floor(steps) * step;
    throw InputError(name + ": step = " + shown_number(step) + " does not lead from " +
                     shown_number(from) + " to " + shown_number(to) + ": the value after " +
                     shown_number(below) + " would be " + shown_number(below + step) +
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

namespace {

/// Whether a coarse mesh, which falls nearly alike and at a small part of the cost, passes H with
/// room to spare.
bool is_reached_by_far(solver::ModelParameters model, double H_m) {
  constexpr int kCoarse = 2;
  constexpr double kRoom = 0.98;
  if (model.elements_per_link <= kCoarse) {
    return false;
  }
  model.elements_per_link = kCoarse;
  model.dt_fall_s = 0.0;  // the coarse mesh's own
  return H_m <= kRoom * solver::Finger(model).largest_drop_m();
}

}  // namespace

void check_reach(const protocol::PointTable& table, int block) {
  // No finger falls through less than this part of its length, so lower drops need no look.
  constexpr double kSurelyReached = 0.9;
  const double H_m = largest_H_m(table.recipe().blocks(block));
  for (const auto& model : falls_of_block(table, block)) {
    const double length_m = std::accumulate(model.lengths_m.begin(), model.lengths_m.end(), 0.0);
    if (H_m <= kSurelyReached * length_m) {
      continue;
    }
    if (is_reached_by_far(model, H_m)) {
      continue;
    }
    const double reach_m = solver::Finger(model).largest_drop_m();
    if (H_m > reach_m) {
      throw InputError(
          "H = " + shown_number(H_m) +
          " m is not allowed: the tip of this finger first turns back after a drop of " +
          shown_number(reach_m) + " m, so H must be at most that");
    }
  }
}

void check_study_name(const std::string& name) {
  constexpr std::size_t kMostBytes = 100;
  const bool plain = std::none_of(name.begin(), name.end(), [](char letter) {
    return static_cast<unsigned char>(letter) < 0x20 || letter == 0x7f;
  });
  if (name.empty() || name.size() > kMostBytes || name.front() == '-' || !plain) {
    throw InputError("name = \"" + name.substr(0, kMostBytes) +
                     "\" is not allowed: a study's name has 1 to " + std::to_string(kMostBytes) +
                     " bytes, no control characters, and does not begin with '-'");
  }
}

}  // namespace oblique::client
