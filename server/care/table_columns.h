#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "server/database/sqlite.h"

// Tables of databases, some of which may be damaged.
namespace oblique::server {

/// In the order of the table; none for a table that is not there.
std::vector<std::string> columns_of(sqlite3* database, const std::string& table);

/// The columns that both have, as a list for SQL, in the order of `to`.
std::string common_columns(sqlite3* from, sqlite3* to, const std::string& table);

/// Studies that are deleted, of which rows may be left.
std::set<std::uint64_t> deleted_studies(sqlite3* database);

/// An expression that is true of each row of `packed_results` that is as it was written, as far as
/// that can be told. The connection must have `row_checksum`.
std::string result_soundness_sql();

}  // namespace oblique::server
