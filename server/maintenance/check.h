#pragma once

#include <string>
#include <vector>

#include "server/database/sqlite.h"

namespace oblique::server {

/// Findings about a database, a sentence each.
struct Diagnosis {
  std::vector<std::string> faults;   ///< damage, at most twenty of a kind; empty: it is sound
  std::vector<std::string> remarks;  ///< studies that are not finished, and what cannot be checked
};

/// Checks the database at `path`: its pages, indices, tables, views and triggers, and its contents
/// as `diagnose_contents` does. Throws StorageError when it is no database of ours.
Diagnosis diagnose(const std::string& path);

/// The faults alone.
std::vector<std::string> find_faults(const std::string& path);

/// What SQLite finds wrong with the pages and indices of an open database, at most twenty; empty:
/// they are sound.
std::vector<std::string> faults_of_pages(sqlite3* database);

/// Checks the definitions of our tables and, where these are sound, all studies, models and
/// results: checksums, references, lists, each row against the recipe of its study, and completed
/// points and state of each study against its rows. The connection must have `row_checksum`. Throws
/// StorageError.
Diagnosis diagnose_contents(sqlite3* database);

/// What is wrong with a row of `results` by itself, as an expression; NULL: nothing.
std::string row_fault_sql();

}  // namespace oblique::server
