#pragma once

#include <functional>
#include <string>

#include "server/database/sqlite.h"

namespace oblique::server {

/// Makes the tables and views of the present schema in an empty database, which gets an identity.
/// Throws StorageError.
void create_schema(sqlite3* database);

/// Brings a database of an older schema to the present one, in one transaction: all of it or,
/// whatever happens, nothing. `notice` is told how long it takes and what came of it. A row that is
/// not as it was stored is left out, and its point is to be solved again. The connection must have
/// `row_checksum`. Throws StorageError.
void migrate(sqlite3* database, const std::function<void(const std::string&)>& notice);

/// Whether pages that nothing needs any more can be given back, which files of schemas before 8
/// cannot.
bool gives_space_back(sqlite3* database);
/// Writes the database again, so that they can, and gives back all there are. What keeps it from
/// that is told: the database is whole all the same, and the next one who opens it tries again.
void make_it_give_space_back(sqlite3* database,
                             const std::function<void(const std::string&)>& notice);

}  // namespace oblique::server
