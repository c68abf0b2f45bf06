#pragma once

#include <string>
#include <vector>

#include "server/database/sqlite.h"

namespace oblique::server {

/// Creates the tables in an empty database, which gets a random identity. Throws StorageError.
void create_tables(sqlite3* database);

/// Creates the views and the trigger of this schema anew, and its indices where they were dropped.
/// Objects with other names stay. If the trigger was not there, rows may
/// have been deleted unnoticed, so all studies are marked to be counted again. Throws StorageError,
/// as where a table has the name of a view.
void create_views(sqlite3* database);

/// A table of this schema and the statement that creates it.
struct TableDefinition {
  std::string name;
  std::string sql;  ///< as `sqlite_schema` has it
};
const std::vector<TableDefinition>& our_tables();

/// Those tables and those views that a database of this schema lacks. Throws StorageError.
std::vector<std::string> missing_tables(sqlite3* database);
std::vector<std::string> missing_views(sqlite3* database);

/// Names of the triggers that this schema does not have, or has with another text: they would run
/// with each change of the writer, and might never end. Throws StorageError.
std::vector<std::string> other_triggers(sqlite3* database);

/// An expression for the highest study number in any table; 0: none. Rows of a study whose row in
/// `studies` was deleted by hand count too.
std::string last_study_id_sql();

}  // namespace oblique::server
