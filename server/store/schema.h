#pragma once

#include <string>
#include <vector>

#include "server/database/sqlite.h"

namespace oblique::server {

/// Creates the tables in an empty database, which gets a random identity. Throws StorageError.
void create_tables(sqlite3* database);

/// Creates the views and the trigger of this schema again, and its indices where they were dropped.
/// Objects with other names stay. If the trigger was missing, rows may have been deleted without
/// notice, so all studies are marked to be counted again. Throws StorageError, for example if a
/// table has the name of a view.
void create_views(sqlite3* database);

/// A table of this schema and the statement that creates it.
struct TableDefinition {
  std::string name;
  std::string sql;  ///< as in `sqlite_schema`
};
const std::vector<TableDefinition>& our_tables();

/// The tables, and the views, of this schema that the database lacks. Throws StorageError.
std::vector<std::string> missing_tables(sqlite3* database);
std::vector<std::string> missing_views(sqlite3* database);

/// Names of triggers that are not in this schema, or that have another text there. They would run
/// with each change of the writer and might never end. Throws StorageError.
std::vector<std::string> other_triggers(sqlite3* database);

/// An SQL expression for the highest study number in any table; 0: none. Rows of a study whose row
/// in `studies` was deleted by hand count too.
std::string last_study_id_sql();

}  // namespace oblique::server
