#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/blocks.h"
#include "worker/solver/model/parameters.h"

// Axes and samples from study files and flags. Each function throws InputError, which names key,
// value and what is allowed.
namespace oblique::protocol {

Axis listed_axis(const solver::ParameterKey& key, const std::vector<double>& values,
                 BlockKind kind = BlockKind::kProduct);

/// `count` values including both ends.
Axis counted_axis(const solver::ParameterKey& key, double from, double to, std::int64_t count,
                  Spacing spacing = SPACING_LINEAR);
[[noreturn]] void throw_wrong_count(const solver::ParameterKey& key, std::string_view written);

/// Values `step` apart, the last of which is `to`.
Axis stepped_axis(const solver::ParameterKey& key, double from, double to, double step);

/// A distribution; parts that were not written are empty.
struct WrittenDistribution {
  DistributionKind kind = DISTRIBUTION_UNIFORM;
  std::optional<double> from;
  std::optional<double> to;
  std::optional<double> mean;
  std::optional<double> sd;
};
/// `kind` must be `kSample`.
Axis drawn_axis(const solver::ParameterKey& key, const WrittenDistribution& distribution,
                BlockKind kind);

/// An axis computed from others by an expression such as "A^2 / (4 * pi)".
Axis expressed_axis(const solver::ParameterKey& key, std::string_view text);

/// `kind` is random, lhs or sobol.
Sample written_sample(std::string_view kind, std::int64_t count, std::int64_t seed);
inline constexpr std::int64_t kUsualSeed = 1;

/// Names in the order of the kinds' numbers: uniform, log-uniform, normal; random, lhs, sobol.
const std::vector<std::string_view>& distribution_names();
const std::vector<std::string_view>& sample_names();
std::string_view name_of(DistributionKind kind);
std::string_view name_of(SampleKind kind);
DistributionKind distribution_named(std::string_view name);

}  // namespace oblique::protocol
