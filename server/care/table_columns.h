#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "server/database/sqlite.h"

// Tables of databases of this and of earlier schemas.
namespace oblique::server {

/// PRAGMA user_version.
int schema_of(sqlite3* database);

/// In the order of the table; none for a table that is not there.
std::vector<std::string> columns_of(sqlite3* database, const std::string& table);

/// The columns that both have, as a list for SQL, in the order of `to`.
std::string common_columns(sqlite3* from, sqlite3* to, const std::string& table);

/// Studies that are deleted, of which rows may be left.
std::set<std::uint64_t> deleted_studies(sqlite3* database);

/// `columns` of the table of a database of that schema as expressions for the values that the
/// present schema has in them. The connection must have `model_definition`.
std::string present_values_sql(int schema, const std::string& table, std::string columns);

/// An expression that is true of each row of `results` that is as it was written, as far as that
/// can be told. The connection must have `row_checksum`.
std::string result_soundness_sql(int schema);

}  // namespace oblique::server
