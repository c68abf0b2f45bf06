#pragma once

#include <string>
#include <vector>

#include "server/database/sqlite.h"

namespace oblique::server {

/// Findings about a database, one sentence each.
struct Diagnosis {
  std::vector<std::string> faults;   ///< damage, at most twenty of each kind; empty: none
  std::vector<std::string> remarks;  ///< unfinished studies, and checks that were impossible
};

/// Checks pages, indices and contents of the database at `path`. Throws StorageError if it is not a
/// database of ours.
Diagnosis diagnose(const std::string& path);

/// The faults that SQLite finds in pages and indices of an open database, at most twenty.
std::vector<std::string> faults_of_pages(sqlite3* database);

/// Checks the definitions of our tables and, if these are sound, all studies, models and results:
/// checksums, references, lists, each row against the recipe of its study, and completed points and
/// state of each study against its rows. Throws StorageError.
Diagnosis diagnose_contents(sqlite3* database);

/// An SQL expression for the fault of a row of `results`, without looking at other tables; NULL:
/// none.
std::string row_fault_sql();

}  // namespace oblique::server
