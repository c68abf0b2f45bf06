#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frames.h"
#include "proto/oblique.pb.h"
#include "worker/solver/model/parameters.h"

// Converts models and recipes between structs, messages, texts, digests, study files and flags.
namespace oblique::protocol {

ModelParameters to_message(const solver::ModelParameters& model);

/// Converts the message. Throws solver::InputError if the model is outside its domain.
solver::ModelParameters from_message(const ModelParameters& message);

/// Converts the message without checking the domain, for models that an earlier version may have
/// stored. Throws solver::InputError only for numbers that the struct cannot hold.
solver::ModelParameters from_message_unchecked(const ModelParameters& message);

/// Returns the canonical text of a model, which is equal for equal models: "oblique-model-1
/// lengths=0.4,0.4,0.4 E=7e+10 ...". README.md defines it byte by byte. The values need not be in
/// their domains.
std::string canonical_model(const solver::ModelParameters& model);

/// Returns whether two blocks have the same axes, zip, sample and filter, as they are written.
bool is_same_block(const Block& a, const Block& b);

/// Returns the SHA-256, in hexadecimal digits, of the recipe's model, blocks and request for
/// estimated errors.
std::string recipe_digest(const Recipe& recipe);

/// Maximum size of a recipe [bytes]. A frame for a worker contains the recipe and other fields.
inline constexpr std::size_t kMaxRecipeBytes = kMaxFrameBytes - 1024;

/// Throws solver::InputError if the recipe does not fit into a frame for a worker.
void check_size(const Recipe& recipe);

/// Parses a recipe from a database file. The limits are those for recipes from the network, because
/// a parsed recipe can need a hundred times the memory of its bytes. Returns false if the recipe is
/// damaged or exceeds the limits.
bool parse_recipe(std::string_view bytes, Recipe& recipe);

/// Returns the SHA-256 of `bytes` in hexadecimal digits.
std::string sha256_of(std::string_view bytes);

// These functions make parts of recipes from study files and flags. Each throws solver::InputError
// for input that a recipe cannot represent; PointTable checks the values.

Axis listed_axis(const solver::ParameterKey& key, const std::vector<double>& values);

/// Makes an axis with `count` values including both ends.
Axis counted_axis(const solver::ParameterKey& key, double from, double to, std::int64_t count,
                  Spacing spacing = SPACING_LINEAR);
[[noreturn]] void throw_wrong_count(const solver::ParameterKey& key, std::string_view written);

/// Makes an axis with values `step` apart, which must end exactly at `to`.
Axis stepped_axis(const solver::ParameterKey& key, double from, double to, double step);

Axis drawn_axis(const solver::ParameterKey& key, Distribution distribution);

/// Makes an axis whose values an expression computes from other keys, such as "A^2 / (4 * pi)".
Axis expressed_axis(const solver::ParameterKey& key, std::string_view text);

/// `kind` is random, lhs or sobol.
Sample parse_sample(std::string_view kind, std::int64_t count, std::int64_t seed);
inline constexpr std::int64_t kUsualSeed = 1;

/// Return names in the order of the enumeration: uniform, log-uniform, normal; random, lhs, sobol.
std::span<const std::string_view> distribution_names();
std::string_view name_of(DistributionKind kind);
std::string_view name_of(SampleKind kind);
DistributionKind distribution_named(std::string_view name);

/// A model as given in a study file or by flags: a preset, lengths of the links [m], and single
/// keys that override it.
struct ModelInput {
  /// The keys of a study file's model in addition to `solver::model_keys()`.
  static constexpr std::string_view kPreset = "preset";
  static constexpr std::string_view kLengths = "lengths";
  /// The error message if `lengths` is given together with keys that it replaces.
  static constexpr std::string_view kLengthsConflict =
      "lengths cannot be combined with links or length: give lengths, one per link, or links and "
      "length";

  std::string preset = std::string(solver::preset_names().front());
  std::optional<std::vector<double>> lengths_m = {};
  std::map<std::string, double, std::less<>> values = {};

  /// Returns the model. Throws solver::InputError, which names the key, for unknown keys, and for
  /// values and combinations that are not allowed.
  solver::ModelParameters model() const;
};

/// Returns the model key called `name`. Throws solver::InputError for an unknown key, with the
/// nearest key and a list of all.
const solver::ParameterKey& model_key(std::string_view name);

/// Returns why a study may not have this name, or an empty text. A name has 1 to 100 bytes of UTF-8
/// and no control characters (text.h), and does not begin with '-'.
std::string study_name_error(const std::string& name);

inline constexpr std::string_view kPriorities = "-1000 to 1000";
/// Returns why the priority is not allowed, or an empty text.
std::string priority_error(std::int64_t priority);

}  // namespace oblique::protocol
