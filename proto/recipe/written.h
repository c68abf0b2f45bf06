#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"
#include "worker/solver/model/parameters.h"

// Parts of study files and flags as parts of recipes. Each function throws InputError for what a
// recipe cannot hold; PointTable checks the values.
namespace oblique::protocol {

Axis listed_axis(const solver::ParameterKey& key, const std::vector<double>& values);

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
Axis drawn_axis(const solver::ParameterKey& key, const WrittenDistribution& distribution);

/// An axis computed from others by an expression such as "A^2 / (4 * pi)".
Axis expressed_axis(const solver::ParameterKey& key, std::string_view text);

/// `kind` is random, lhs or sobol.
Sample written_sample(std::string_view kind, std::int64_t count, std::int64_t seed);
inline constexpr std::int64_t kUsualSeed = 1;

/// Names in the order of the kinds' numbers: uniform, log-uniform, normal; random, lhs, sobol.
std::span<const std::string_view> distribution_names();
std::string_view name_of(DistributionKind kind);
std::string_view name_of(SampleKind kind);
DistributionKind distribution_named(std::string_view name);

/// A model from a study file or flags: a preset, and single keys that override it, set in any
/// order. A wrong value throws InputError when it is set; the message names key, value and what is
/// allowed.
class WrittenModel {
 public:
  /// The keys of a written model in addition to `solver::model_keys()`.
  static constexpr std::string_view kPreset = "preset";
  static constexpr std::string_view kLengths = "lengths";
  /// The message if `lengths` is used together with the keys that it replaces.
  static constexpr std::string_view kLengthsStandAlone =
      "lengths stands beside links or length: give either lengths, one a link, or links and length";

  void set_preset(std::string_view name);
  /// Sets one length [m] per link. Not allowed together with the keys links and length.
  void set_lengths(std::vector<double> lengths_m);
  void set(std::string_view key, double value);

  /// The model. Throws InputError for values that are wrong only in combination.
  solver::ModelParameters model() const;

 private:
  void check_lengths_alone() const;

  solver::ModelParameters preset_;
  std::optional<std::vector<double>> lengths_m_;
  std::map<std::string, double, std::less<>> values_;
};

/// The key of a model called `name`. Throws InputError for an unknown one, with the nearest and
/// the list of all.
const solver::ParameterKey& model_key(std::string_view name);

/// Why a study cannot have that name, or an empty text. A name has 1 to 100 bytes of UTF-8, has no
/// control characters (text.h), and does not begin with '-'.
std::string objection_to_study_name(const std::string& name);

inline constexpr std::int64_t kHighestPriority = 1000;  ///< the lowest is its negative
/// Why a study cannot have that priority, or an empty text.
std::string objection_to_priority(std::int64_t priority);
/// The allowed range for help texts: "-1000 to 1000".
std::string allowed_priorities();

}  // namespace oblique::protocol
