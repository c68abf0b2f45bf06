#pragma once

#include <string>
#include <string_view>

#include "server/database/sqlite.h"
#include "worker/solver/model/parameters.h"

// Rows of the table `models`.
namespace oblique::server {

/// The first schema in which `models.definition` is the canonical text of the model
/// (proto/recipe/canonical.h). Before, it was an oblique.protocol.ModelParameters, serialised.
inline constexpr int kFirstWithCanonicalModels = 5;

/// As the column `definition` has it in that schema.
std::string definition_of(const solver::ModelParameters& model, int schema);

/// Back. Throws std::runtime_error for what is no definition.
solver::ModelParameters model_of_definition(std::string_view definition, int schema);

/// Inserts a model unless there is one of the same definition. Its parameters are those of
/// `bind_model`, which takes the model's definition of the present schema too.
std::string insert_model_sql();
void bind_model(Statement& insert, const solver::ModelParameters& model,
                std::string_view definition);

/// Gives the connection the SQL function `model_definition(blob)`: the present definition of a
/// model for one of the schemas before `kFirstWithCanonicalModels`. What cannot be read becomes
/// "unreadable" and its bytes in hexadecimal digits. Throws StorageError.
void add_model_definition(sqlite3* database);

}  // namespace oblique::server
