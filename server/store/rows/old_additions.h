#pragma once

#include <string>
#include <vector>

#include "server/database/sqlite.h"

namespace oblique::server {

/// What people added to the table `results` of a file before `kFirstPacked`, which is no table any
/// more afterwards. Columns that hold something become the table `added_columns` (study_id, point
/// and theirs), plain indices become those of `packed_results` where that has the columns; what can
/// be neither stands in the table `added_before_8` as the SQL that made it. Tables and views of
/// their own stay as they are.
class OldAdditions {
 public:
  /// Looks at the table `results`, which has all columns of the schema before `kFirstPacked`.
  /// Throws StorageError.
  explicit OldAdditions(sqlite3* database);

  /// Names of the tables and indices that `keep` makes.
  std::vector<std::string> names() const;

  /// Keeps what can be kept, in the caller's transaction, while the old rows are in `table` and
  /// there is `packed_results`. Gives a sentence about each thing that is not as it was. Throws
  /// StorageError.
  std::vector<std::string> keep(const std::string& table);

 private:
  struct Index {
    std::string name;
    std::string sql;
    std::string columns;  // of `packed_results`, as in the statement that makes it
  };

  void find_indices();
  void find_references();
  std::string packed_columns_of(const std::string& index);
  void keep_columns(const std::string& table, std::vector<std::string>& said);
  void keep_indices(std::vector<std::string>& said);
  void note(const char* kind, const std::string& name, const std::string& sql);

  sqlite3* database_;
  std::vector<std::string> columns_;
  std::vector<Index> indices_;
  std::vector<std::string> referring_;  // tables whose foreign keys name `results`
};

/// A sentence about each view that people made and that cannot be read. Throws StorageError.
std::vector<std::string> views_that_fail(sqlite3* database);

}  // namespace oblique::server
