#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"
#include "worker/solver/model/parameters.h"

// Conversion of models and recipes between structs, messages, texts and digests, and from study
// files and flags.
namespace oblique::protocol {

ModelParameters to_message(const solver::ModelParameters& model);

/// Throws solver::InputError if the model is outside its domain.
solver::ModelParameters from_message(const ModelParameters& message);

/// The same without a check of the domain, for models that an earlier version may have stored.
/// Throws solver::InputError only for numbers that the struct cannot hold.
solver::ModelParameters from_message_unchecked(const ModelParameters& message);

/// The canonical text of a model, equal for equal models: "oblique-model-1 lengths=0.4,0.4,0.4
/// E=7e+10 ...". README.md defines it byte by byte. The values need not be in their domains.
std::string canonical_model(const solver::ModelParameters& model);

/// Whether two blocks have the same axes, zip, sample and filter, as they are written.
bool is_same_block(const Block& a, const Block& b);

/// SHA-256 in hexadecimal digits of the model, the request for estimated errors and the blocks.
std::string recipe_digest(const Recipe& recipe);

/// Throws solver::InputError if the recipe does not fit into a frame for a worker.
void check_size(const Recipe& recipe);

/// Parses a recipe from a database file, with the limits for recipes from the network, because a
/// parsed recipe can need a hundred times the memory of its bytes. False if it is damaged or
/// exceeds the limits.
bool parse_recipe(std::string_view bytes, Recipe& recipe);

/// SHA-256 in hexadecimal digits.
std::string sha256_of(std::string_view bytes);

// Parts of recipes from study files and flags. Each function throws solver::InputError for input
// that a recipe cannot represent; PointTable checks the values.

Axis listed_axis(const solver::ParameterKey& key, const std::vector<double>& values);

/// `count` values including both ends.
Axis counted_axis(const solver::ParameterKey& key, double from, double to, std::int64_t count,
                  Spacing spacing = SPACING_LINEAR);
[[noreturn]] void throw_wrong_count(const solver::ParameterKey& key, std::string_view written);

/// Values `step` apart, the last of which is `to`.
Axis stepped_axis(const solver::ParameterKey& key, double from, double to, double step);

Axis drawn_axis(const solver::ParameterKey& key, Distribution distribution);

/// An axis computed from others by an expression such as "A^2 / (4 * pi)".
Axis expressed_axis(const solver::ParameterKey& key, std::string_view text);

/// `kind` is random, lhs or sobol.
Sample parse_sample(std::string_view kind, std::int64_t count, std::int64_t seed);
inline constexpr std::int64_t kUsualSeed = 1;

/// Names in the order of the enumeration: uniform, log-uniform, normal; random, lhs, sobol.
std::span<const std::string_view> distribution_names();
std::string_view name_of(DistributionKind kind);
std::string_view name_of(SampleKind kind);
DistributionKind distribution_named(std::string_view name);

/// A model as given in a study file or by flags: a preset, lengths [m] of the links, and single
/// keys that override it.
struct ModelInput {
  /// The keys of a study file's model in addition to `solver::model_keys()`.
  static constexpr std::string_view kPreset = "preset";
  static constexpr std::string_view kLengths = "lengths";
  /// The message for `lengths` together with keys that it replaces.
  static constexpr std::string_view kLengthsConflict =
      "lengths cannot be combined with links or length: give lengths, one per link, or links and "
      "length";

  std::string preset = std::string(solver::preset_names().front());
  std::optional<std::vector<double>> lengths_m = {};
  std::map<std::string, double, std::less<>> values = {};

  /// Throws solver::InputError with the key for unknown keys, and for values and combinations that
  /// are not allowed.
  solver::ModelParameters model() const;
};

/// The model key called `name`. Throws solver::InputError for an unknown one, with the nearest one
/// and a list of all.
const solver::ParameterKey& model_key(std::string_view name);

/// Why the name is not allowed for a study, or an empty text. A name has 1 to 100 bytes of UTF-8,
/// no control characters (text.h), and does not begin with '-'.
std::string study_name_error(const std::string& name);

inline constexpr std::string_view kPriorities = "-1000 to 1000";
/// Why the priority is not allowed, or an empty text.
std::string priority_error(std::int64_t priority);

}  // namespace oblique::protocol
