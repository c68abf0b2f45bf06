#pragma once

#include <string>
#include <vector>

#include "server/database/sqlite.h"

namespace oblique::server {

/// Creates the tables in an empty database and gives it a random ID. Throws StorageError.
void create_tables(sqlite3* database);

/// Recreates the views and the trigger of this schema, and creates missing indices. Does not change
/// objects with other names. Throws StorageError, for example if a table has the name of a view.
void create_views(sqlite3* database);

/// Returns the tables of this schema that are missing or have other columns. Throws StorageError.
std::vector<std::string> differing_tables(sqlite3* database);

/// An SQL expression for the highest study number that was ever used, or 0. It also considers rows
/// of `results` whose study was deleted by hand.
inline constexpr const char* kLastStudyId =
    "max((SELECT coalesce(max(seq), 0) FROM main.sqlite_sequence),"
    " (SELECT coalesce(max(study_id), 0) FROM main.results))";

}  // namespace oblique::server
