#include "proto/recipe/written/written_sample.h"

#include <algorithm>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/checks.h"
#include "proto/suggestion.h"
#include "proto/text.h"

namespace oblique::protocol {

const std::vector<std::string_view>& sample_names() {
  static const std::vector<std::string_view> names{"random", "lhs", "sobol"};
  return names;
}

namespace {

using solver::InputError;

/// The number of a name. `what` begins the sentence about any other.
std::size_t number_of_name(std::string_view name, const std::vector<std::string_view>& names,
                           std::string_view what) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    throw InputError(fmt::format("{} \"{}\" is not known{}: it must be one of {}", what,
                                 excerpt(name), did_you_mean(name, names), joined(names)));
  }
  return static_cast<std::size_t>(found - names.begin());
}

Axis axis_of(const solver::ParameterKey& key) {
  Axis axis;
  axis.set_key(std::string(key.name));
  return axis;
}

void check_parts(const solver::ParameterKey& key, const WrittenDistribution& written) {
  const bool is_normal = written.kind == DISTRIBUTION_NORMAL;
  const bool has_all = is_normal ? written.mean && written.sd : written.from && written.to;
  const bool has_others = !is_normal && (written.mean || written.sd);
  if (!has_all || has_others) {
    throw InputError(fmt::format(
        "{}: {}", key.name,
        is_normal ? "a normal distribution needs mean and sd, its standard deviation; from and to "
                    "cut it off"
                  : fmt::format("a {} distribution needs from and to, and nothing else",
                                name_of(written.kind))));
  }
}

}  // namespace

const std::vector<std::string_view>& distribution_names() {
  static const std::vector<std::string_view> names{"uniform", "log-uniform", "normal"};
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

Axis drawn_axis(const solver::ParameterKey& key, const WrittenDistribution& written,
                BlockKind kind) {
  check_parts(key, written);
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
  if (count < 1) {
    throw InputError(fmt::format(
        "sample: count = {} is not allowed: it must be a whole number, at least 1", count));
  }
  if (seed < 0) {
    throw InputError(fmt::format(
        "sample: seed = {} is not allowed: it must be a whole number, at least 0", seed));
  }
  Sample sample;
  sample.set_kind(static_cast<SampleKind>(number_of_name(kind, sample_names(), "the sample")));
  sample.set_count(static_cast<std::uint64_t>(count));
  sample.set_seed(static_cast<std::uint64_t>(seed));
  return sample;
}

}  // namespace oblique::protocol
