#pragma once

#include <string>
#include <vector>

#include "server/database/sqlite.h"

namespace oblique::server {

/// Findings about a database, a sentence each.
struct Diagnosis {
  std::vector<std::string> faults;   ///< damage, at most twenty of a kind; empty: it is sound
  std::vector<std::string> remarks;  ///< unfinished studies, and checks that were not possible
};

/// Checks the database at `path`: its pages and indices, and its contents as
/// `diagnose_contents` does. Throws StorageError when it is not a database of ours.
Diagnosis diagnose(const std::string& path);

/// The faults that SQLite finds in the pages and indices of an open database, at most twenty;
/// empty: none.
std::vector<std::string> faults_of_pages(sqlite3* database);

/// Checks the definitions of our tables and, where these are sound, all studies, models and
/// results: checksums, references, lists, each row against the recipe of its study, and completed
/// points and state of each study against its rows. Throws StorageError.
Diagnosis diagnose_contents(sqlite3* database);

/// An SQL expression for the fault of a row of `results` regardless of other tables; NULL: none.
std::string row_fault_sql();

}  // namespace oblique::server
