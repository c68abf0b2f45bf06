#pragma once

#include <functional>
#include <string>
#include <vector>

#include "server/database/sqlite.h"

// Views, triggers and indices that every database of this schema has. Other programs may have
// dropped or replaced some; what people made under other names is theirs, but for triggers. Tables,
// which cannot be made again with what they held, are only named.
namespace oblique::server {

/// Makes the tables and views in an empty database, which gets an identity. Throws StorageError.
void create_schema(sqlite3* database);

/// The names of the tables of this schema.
const std::vector<std::string>& our_tables();

/// Those of them that a database of this schema lacks. Throws StorageError.
std::vector<std::string> missing_tables(sqlite3* database);

/// A sentence for each one that is missing or other than ours, and each whose name something else
/// has. Throws StorageError.
std::vector<std::string> faults_of_views(sqlite3* database);

/// The names of those of our views that are missing.
std::vector<std::string> missing_views(sqlite3* database);

/// Throws StorageError naming the triggers that this schema does not have: they would run with each
/// change of the writer, and may never end. `path` is for the message.
void refuse_other_triggers(sqlite3* database, const std::string& path);

/// Makes those again, in one transaction, and says so. What has the name of one and is none is
/// named and left as it is. Says whether anything was done. Throws StorageError.
bool restore_views(sqlite3* database, const std::function<void(const std::string&)>& notice);

}  // namespace oblique::server
