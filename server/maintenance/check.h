#pragma once

#include <string>
#include <vector>

#include "server/database/sqlite.h"

namespace oblique::server {

/// Findings about a database. Each is a sentence.
struct Diagnosis {
  std::vector<std::string> faults;   ///< damage, with at most twenty sentences of each kind
  std::vector<std::string> remarks;  ///< unfinished studies, and checks that were not possible
};

/// Checks pages, indices and contents of a database. Throws StorageError if it is not one of ours.
Diagnosis diagnose(const std::string& path);

/// Returns the faults that SQLite finds in pages and indices of an open database, at most twenty.
std::vector<std::string> faults_of_pages(sqlite3* database);

/// Checks our definitions of tables, indices, triggers and views. If they are right, also checks
/// all studies, models, workers and results: checksums, references, lists, each row against the
/// recipe of its study, and completed points and state of each study against its rows. Throws
/// StorageError.
Diagnosis diagnose_contents(sqlite3* database);

/// Returns an SQL expression for the fault of a row of `results`; its value is NULL for a sound
/// row. It reads no other tables.
std::string row_fault_sql();

}  // namespace oblique::server
