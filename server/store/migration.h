#pragma once

#include "server/database/sqlite.h"

namespace oblique::server {

/// Makes the tables and views of the present schema in an empty database, which gets an identity.
/// Throws StorageError.
void create_schema(sqlite3* database);

/// Brings a database of an older schema to the present one, in one transaction. Throws
/// StorageError.
void migrate(sqlite3* database);

}  // namespace oblique::server
