#pragma once

#include <string>
#include <vector>

#include "server/database/sqlite.h"

namespace oblique::server {

/// What can be said of a database, a sentence each.
struct Diagnosis {
  std::vector<std::string> faults;   ///< damage, at most some twenty of a kind; empty: it is sound
  std::vector<std::string> remarks;  ///< studies that are not finished, and what cannot be told
};

/// Looks at everything in the database at `path`: every page and index, every reference, that rows
/// are what was stored and of points that their studies have, with the recipe's H, mu, e and model,
/// that no study is called done that is not. Throws StorageError when it is no database of ours.
Diagnosis diagnose(const std::string& path);

/// What SQLite finds wrong with the pages and indices of an open database, at most some twenty;
/// empty: they are sound.
std::vector<std::string> faults_of_pages(sqlite3* database);

/// The faults alone.
std::vector<std::string> find_faults(const std::string& path);

}  // namespace oblique::server
