#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "server/database/sqlite.h"

namespace oblique::server {

/// What can be said of a database, a sentence each.
struct Diagnosis {
  std::vector<std::string> faults;   ///< damage, at most twenty of a kind; empty: it is sound
  std::vector<std::string> remarks;  ///< studies that are not finished, and what cannot be checked
};

/// Checks everything in the database at `path`: every page and index, every reference, every
/// checksum, every row against its study's recipe (point, H, mu, e and model), the settled points
/// and the state of each study against its rows. Throws StorageError when it is no database of
/// ours.
Diagnosis diagnose(const std::string& path);

/// The faults alone.
std::vector<std::string> find_faults(const std::string& path);

/// What SQLite finds wrong with the pages and indices of an open database, at most twenty; empty:
/// they are sound.
std::vector<std::string> faults_of_pages(sqlite3* database);

/// What is wrong with rows by themselves, at most `at_most` of a kind: a reference to a row that
/// does not exist, a row that differs from its checksum, a list that cannot be read, outputs that
/// are missing or there without reason, a model whose columns differ from its definition. The
/// connection must have `row_checksum`. Throws StorageError.
std::vector<std::string> faults_of_rows(sqlite3* database, std::size_t at_most);

}  // namespace oblique::server
