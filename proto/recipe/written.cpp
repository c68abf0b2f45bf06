#include "proto/recipe/written.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/checks.h"
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

constexpr std::array<std::string_view, 3> kDistributions{"uniform", "log-uniform", "normal"};
constexpr std::array<std::string_view, 3> kSamples{"random", "lhs", "sobol"};

/// The index of a name in `names`.
int number_of_name(std::string_view name, std::span<const std::string_view> names,
                   std::string_view key) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    throw InputError(key, fmt::format("the {} \"{}\" is not known{}: it must be one of {}", key,
                                      excerpt(name), did_you_mean(name, names), joined(names)));
  }
  return static_cast<int>(found - names.begin());
}

}  // namespace

Axis listed_axis(const solver::ParameterKey& key, const std::vector<double>& values) {
  Axis axis = axis_of(key);
  axis.mutable_values()->Assign(values.begin(), values.end());
  return axis;
}

void throw_wrong_count(const solver::ParameterKey& key, std::string_view written) {
  throw InputError(
      key.name,
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
  return axis;
}

Axis stepped_axis(const solver::ParameterKey& key, double from, double to, double step) {
  check_ends(key, from, to);
  const double steps = (to - from) / step;
  if (!(std::isfinite(step) && step > 0.0 && steps <= static_cast<double>(kMaxPoints))) {
    throw InputError(
        key.name,
        fmt::format("{}: step = {} is not allowed: step must be > 0 and make at most {} values",
                    key.name, exact_number(step), kMaxPoints));
  }
  const double whole_steps = std::round(steps);
  // Decimal steps are not exact in binary. This tolerance, relative to a step, is well above their
  // rounding.
  const double tolerance = 1e-9 * std::max(1.0, steps);
  if (std::abs(steps - whole_steps) > tolerance) {
    const double below = from + std::floor(steps) * step;
    throw InputError(
        key.name,
        fmt::format("{}: step = {} does not lead from {} to {}: the value after {} would be {}; "
                    "change `to` or the step, or give `count`",
                    key.name, exact_number(step), exact_number(from), exact_number(to),
                    solver::readable_number(below, 10), solver::readable_number(below + step, 10)));
  }
  return counted_axis(key, from, to, static_cast<std::int64_t>(whole_steps) + 1);
}

Axis drawn_axis(const solver::ParameterKey& key, const WrittenDistribution& written) {
  const bool is_normal = written.kind == DISTRIBUTION_NORMAL;
  const bool is_complete = is_normal ? written.mean && written.sd
                                     : written.from && written.to && !written.mean && !written.sd;
  if (!is_complete) {
    throw InputError(
        key.name,
        fmt::format(
            "{}: {}", key.name,
            is_normal
                ? "a normal distribution needs mean and sd, its standard deviation; from and to "
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
  return axis;
}

Axis expressed_axis(const solver::ParameterKey& key, std::string_view text) {
  Axis axis = axis_of(key);
  axis.set_expression(std::string(text));
  return axis;
}

Sample written_sample(std::string_view kind, std::int64_t count, std::int64_t seed) {
  for (const auto& [name, value, least] : {std::tuple{"count", count, 1}, {"seed", seed, 0}}) {
    if (value < least) {
      throw InputError(
          "sample",
          fmt::format("sample: {} = {} is not allowed: it must be a whole number, at least {}",
                      name, value, least));
    }
  }
  Sample sample;
  sample.set_kind(static_cast<SampleKind>(number_of_name(kind, kSamples, "sample")));
  sample.set_count(static_cast<std::uint64_t>(count));
  sample.set_seed(static_cast<std::uint64_t>(seed));
  return sample;
}

std::span<const std::string_view> distribution_names() {
  return kDistributions;
}

std::string_view name_of(DistributionKind kind) {
  return kDistributions.at(static_cast<std::size_t>(kind));
}

std::string_view name_of(SampleKind kind) {
  return kSamples.at(static_cast<std::size_t>(kind));
}

DistributionKind distribution_named(std::string_view name) {
  return static_cast<DistributionKind>(number_of_name(name, distribution_names(), "distribution"));
}

const solver::ParameterKey& model_key(std::string_view name) {
  if (const auto* key = solver::find_model_key(name)) {
    return *key;
  }
  std::vector<std::string_view> known{WrittenModel::kPreset, WrittenModel::kLengths};
  for (const auto& key : solver::model_keys()) {
    known.push_back(key.name);
  }
  throw InputError(
      name, fmt::format("{} of a model: the keys are {}", unknown_key(name, known), joined(known)));
}

void WrittenModel::set_preset(std::string_view name) {
  preset_ = solver::preset(name);
}

void WrittenModel::set_lengths(std::vector<double> lengths_m) {
  lengths_m_ = std::move(lengths_m);
  check_lengths_alone();
  if (lengths_m_->empty()) {
    throw InputError(kLengths, "lengths = [] is not allowed: give the lengths in m, one a link");
  }
  solver::ParameterKey key = model_key("length");
  key.name = kLengths;
  for (const double length_m : *lengths_m_) {
    solver::check_value(key, length_m);
  }
}

void WrittenModel::set(std::string_view key, double value) {
  solver::check_value(model_key(key), value);
  values_.insert_or_assign(std::string(key), value);
  check_lengths_alone();
}

void WrittenModel::check_lengths_alone() const {
  if (lengths_m_ && (values_.contains("links") || values_.contains("length"))) {
    throw InputError(kLengths, std::string(kLengthsStandAlone));
  }
}

solver::ModelParameters WrittenModel::model() const {
  solver::ModelParameters model = preset_;
  if (lengths_m_) {
    model.lengths_m = *lengths_m_;
  }
  // In the order of the listing: `links` must come before `length`.
  for (const auto& key : solver::model_keys()) {
    if (const auto value = values_.find(key.name); value != values_.end()) {
      key.set(model, value->second);
    }
  }
  solver::validate(model);
  return model;
}

std::string objection_to_study_name(const std::string& name) {
  constexpr std::size_t kMostBytes = 100;
  if (!name.empty() && name.size() <= kMostBytes && name.front() != '-' && is_visible(name)) {
    return {};
  }
  return "name = \"" + visible(name.substr(0, kMostBytes)) +
         "\" is not allowed: a study's name has 1 to " + std::to_string(kMostBytes) +
         " bytes of UTF-8, no control characters, marks of writing direction or zero-width "
         "characters, "
         "and does not begin with '-'";
}

std::string allowed_priorities() {
  return fmt::format("{} to {}", -kHighestPriority, kHighestPriority);
}

std::string objection_to_priority(std::int64_t priority) {
  const bool is_allowed = priority >= -kHighestPriority && priority <= kHighestPriority;
  return is_allowed
             ? ""
             : fmt::format("priority = {} is not allowed: {} is", priority, allowed_priorities());
}

}  // namespace oblique::protocol
