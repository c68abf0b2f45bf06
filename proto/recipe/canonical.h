#pragma once

#include <string>
#include <string_view>

#include "proto/oblique.pb.h"
#include "worker/solver/model/parameters.h"

namespace oblique::protocol {

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

}  // namespace oblique::protocol
