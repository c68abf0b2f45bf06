#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "server/database/sqlite.h"

namespace oblique::server {

/// What is wrong with the rows of a database whose pages are sound, a sentence each, at most
/// `at_most` of a kind: a row or a study that is not the one that was stored (by its checksum), a
/// model or point that is not the recipe's, outputs missing or there without reason. Rows without a
/// checksum are also held against themselves: their arrays must be readable and agree with the
/// columns that say the same. The database must have `row_checksum`. Reads everything.
std::vector<std::string> faults_of_rows(sqlite3* database, std::size_t at_most);

/// Those of them that are of models: columns that do not say what the definition does. A sentence
/// each, at most `at_most`.
std::vector<std::string> faults_of_models(sqlite3* database, std::size_t at_most);

}  // namespace oblique::server
