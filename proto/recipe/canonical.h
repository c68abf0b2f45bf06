#pragma once

#include <string>
#include <string_view>

#include "proto/oblique.pb.h"
#include "worker/solver/model/parameters.h"

namespace oblique::protocol {

/// The text by which models are the same: "oblique-model-1 lengths=0.4,0.4,0.4 E=7e+10 ...".
/// README.md gives it byte by byte. The model need not be allowed.
std::string canonical_model(const solver::ModelParameters& model);

/// The model of such a text. Throws solver::InputError for any other text; judges no value.
solver::ModelParameters model_of_canonical(std::string_view text);

/// Whether two blocks are the same: axes, zip, sample and filter as they are written.
bool is_same_block(const Block& a, const Block& b);

/// SHA-256 in hexadecimal digits of the model, the choice of errors and the blocks, the same for
/// recipes in which all of these are the same.
std::string recipe_digest(const Recipe& recipe);

}  // namespace oblique::protocol
