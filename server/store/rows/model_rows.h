#pragma once

#include <string>
#include <string_view>

#include "server/database/sqlite.h"
#include "worker/solver/model/parameters.h"

// Rows of the table `models`.
namespace oblique::server {

/// Inserts a model unless there is one of the same definition. Its parameters are those of
/// `bind_model`, which takes the model's canonical text (proto/recipe/canonical.h) too.
std::string insert_model_sql();
void bind_model(Statement& insert, const solver::ModelParameters& model,
                std::string_view definition);

}  // namespace oblique::server
