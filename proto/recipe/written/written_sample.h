#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/blocks.h"
#include "worker/solver/model/parameters.h"

// What people wrote of samples, distributions and expressions. Each throws InputError naming key,
// value and what is allowed.
namespace oblique::protocol {

/// A distribution, of which nobody wrote what is absent.
struct WrittenDistribution {
  DistributionKind kind = DISTRIBUTION_UNIFORM;
  std::optional<double> from;
  std::optional<double> to;
  std::optional<double> mean;
  std::optional<double> sd;
};

/// An axis that is drawn, as only a block of kind `kSample` may have one.
Axis drawn_axis(const solver::ParameterKey& key, const WrittenDistribution& distribution,
                BlockKind kind);

/// An axis that follows from others, as "A^2 / (4 * pi)".
Axis expressed_axis(const solver::ParameterKey& key, std::string_view text);

/// `kind` goes by its name: random, lhs or sobol.
Sample written_sample(std::string_view kind, std::int64_t count, std::int64_t seed);

/// The seed of a sample of which none was written.
inline constexpr std::int64_t kUsualSeed = 1;

/// uniform, log-uniform or normal; random, lhs or sobol. Kinds must be known.
std::string_view name_of(DistributionKind kind);
std::string_view name_of(SampleKind kind);
DistributionKind distribution_named(std::string_view name);
const std::vector<std::string_view>& distribution_names();
/// By their numbers.
const std::vector<std::string_view>& sample_names();

}  // namespace oblique::protocol
