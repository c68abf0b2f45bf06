#pragma once

#include <string>
#include <vector>

#include "server/database/sqlite.h"

namespace oblique::server {

/// Creates the tables in an empty database, which gets a random identity. Throws StorageError.
void create_tables(sqlite3* database);

/// Creates the views, the indices and the triggers of this schema, also where another program
/// dropped or replaced them. Objects with other names stay. Throws StorageError, as where a table
/// has the name of a view.
void create_views(sqlite3* database);

/// Creates the views for this connection alone, where they hide those of the file. Throws
/// StorageError.
void create_temporary_views(sqlite3* database);

/// The names of the tables of this schema.
const std::vector<std::string>& our_tables();

/// Those tables and those views that a database of this schema lacks. Throws StorageError.
std::vector<std::string> missing_tables(sqlite3* database);
std::vector<std::string> missing_views(sqlite3* database);

/// Names of the triggers that this schema does not have: they would run with each change of the
/// writer, and might never end. Throws StorageError.
std::vector<std::string> other_triggers(sqlite3* database);

}  // namespace oblique::server
