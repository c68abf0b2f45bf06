#pragma once

#include <functional>
#include <string>
#include <vector>

#include "server/database/sqlite.h"

// Views, triggers and indices that every database of this schema has. Other programs may have
// dropped or replaced some; what people made under other names is theirs, but for triggers. Tables,
// which cannot be made again with what they held, are only named.
namespace oblique::server {

/// The names of the tables of this schema.
const std::vector<std::string>& our_tables();

/// Those of them that a database of this schema lacks. Throws StorageError.
std::vector<std::string> missing_tables(sqlite3* database);

/// What has a name that this schema wants in a database of the one before it, or one of `more`
/// names, and what to do about it, in one sentence; empty where nothing has. Throws StorageError.
std::string names_in_the_way(sqlite3* database, const std::vector<std::string>& more);

/// A sentence for each one that is missing or other than ours, and each whose name something else
/// has. The database has the present schema. Throws StorageError.
std::vector<std::string> faults_of_views(sqlite3* database);

/// The names of those of our views that are missing; none where the schema is another one.
std::vector<std::string> missing_views(sqlite3* database);

/// Throws StorageError naming the triggers that this schema does not have: they would run with each
/// change of the writer, and may never end. `path` is for the message.
void refuse_other_triggers(sqlite3* database, const std::string& path);

/// Makes those again, in one transaction, and says so. What has the name of one and is none is
/// named and left as it is. Says whether anything was done. Throws StorageError.
bool restore_views(sqlite3* database, const std::function<void(const std::string&)>& notice);

/// Makes our views for this connection alone, before those of the file. Throws StorageError.
void shadow_views(sqlite3* database);

}  // namespace oblique::server
