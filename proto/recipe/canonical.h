#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "proto/oblique.pb.h"
#include "proto/recipe/sha256.h"
#include "worker/solver/model/parameters.h"

// The canonical encoding of models and recipes: a text that people can read, the same for all ways
// of writing one thing. README.md of this folder gives it byte by byte. Two models, or recipes, are
// the same when their texts are.
namespace oblique::protocol {

/// "oblique-model-1 lengths=0.4,0.4,0.4 E=7e+10 ...". Of any model, allowed or not.
std::string canonical_model(const solver::ModelParameters& model);

/// The model of such a text. Throws solver::InputError for any other text; judges no value.
solver::ModelParameters model_of_canonical(std::string_view text);

/// The same with other keys than `solver::model_keys()`: what a key that comes later will do.
std::string canonical_model(const solver::ModelParameters& model,
                            std::span<const solver::ParameterKey> keys);

/// Gives the text of a recipe to `take`, in pieces of a few kilobytes. Of a recipe that was judged,
/// or one whose keys are known at least. The text of a recipe with more blocks begins with this
/// one.
void write_canonical(const Recipe& recipe, const std::function<void(std::string_view)>& take);
std::string canonical_recipe(const Recipe& recipe);

/// SHA-256 of that text, which stands for it where recipes are compared.
Sha256::Digest recipe_digest(const Recipe& recipe);

}  // namespace oblique::protocol
