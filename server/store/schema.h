#pragma once

#include <string>
#include <vector>

#include "server/database/sqlite.h"

namespace oblique::server {

/// Creates the tables in an empty database, which gets a random identity. Throws StorageError.
void create_tables(sqlite3* database);

/// Creates the views and the trigger of this schema again, and its indices where they were dropped.
/// Objects with other names stay. Throws StorageError, for example if a table has the name of a
/// view.
void create_views(sqlite3* database);

/// The tables of this schema that the database lacks or has with other columns. Throws
/// StorageError.
std::vector<std::string> differing_tables(sqlite3* database);

/// An SQL expression for the highest study number that was ever given; 0: none. Rows of a study
/// whose row in `studies` was deleted by hand count too.
inline constexpr const char* kLastStudyId =
    "max((SELECT coalesce(max(seq), 0) FROM main.sqlite_sequence),"
    " (SELECT coalesce(max(study_id), 0) FROM main.results))";

}  // namespace oblique::server
