#pragma once

#include <string>
#include <string_view>

#include "proto/oblique.pb.h"
#include "worker/solver/model/parameters.h"

// Models and recipes as messages, as texts and as digests.
namespace oblique::protocol {

/// Every parameter of a model.
ModelParameters to_message(const solver::ModelParameters& model);

/// Throws solver::InputError when the message is outside the model's domain.
solver::ModelParameters from_message(const ModelParameters& message);

/// The same for a model that may be outside its domain, for example one that an earlier version
/// stored. Throws solver::InputError only for numbers that the struct cannot hold.
solver::ModelParameters unjudged_from_message(const ModelParameters& message);

/// A text that is equal for equal models: "oblique-model-1 lengths=0.4,0.4,0.4 E=7e+10 ...".
/// README.md defines it byte by byte. The values need not be in their domains.
std::string canonical_model(const solver::ModelParameters& model);

/// The model of such a text. Throws solver::InputError for any other text; does not validate
/// values.
solver::ModelParameters model_of_canonical(std::string_view text);

/// Whether two blocks are the same: axes, zip, sample and filter as they are written.
bool is_same_block(const Block& a, const Block& b);

/// SHA-256, in hexadecimal digits, of the model, the request for estimated errors, and the blocks.
/// Equal for recipes in which all of these are equal.
std::string recipe_digest(const Recipe& recipe);

/// SHA-256 in hexadecimal digits, as `sha256sum` prints it.
std::string sha256_of(std::string_view bytes);

}  // namespace oblique::protocol
