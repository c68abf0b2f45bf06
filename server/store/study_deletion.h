#pragma once

#include <cstddef>
#include <cstdint>

#include "server/database/sqlite.h"

namespace oblique::server {

/// Deletes studies. One transaction removes the study and enters it in the table `deletions`. Its
/// rows are deleted afterwards in small transactions, so that results can be stored in between. All
/// state is in the database: after a kill another process continues.
class StudyDeletion {
 public:
  /// `database` has the present schema and must outlive this.
  explicit StudyDeletion(sqlite3* database) : database_(database) {}

  /// Deletes the study except its rows. The caller has begun a transaction. Throws StorageError.
  void remove(std::uint64_t study_id);

  /// Whether rows of deleted studies may be left. Throws StorageError.
  bool has_rows() const;

  /// Deletes at most `most` rows. The caller has begun a transaction. Throws StorageError.
  void delete_rows(std::size_t most);

  /// Deletes models and workers without rows, once all rows of deleted studies are gone. Reads all
  /// rows of the file then. To be called before any model or worker is in use, in a transaction of
  /// the caller. Throws StorageError.
  void remove_orphans();

  std::uint64_t rows() const { return rows_; }  ///< number of rows deleted by this object

 private:
  std::size_t delete_some(const char* sql, std::uint64_t study_id, std::size_t most);

  sqlite3* database_;
  std::uint64_t rows_ = 0;
};

}  // namespace oblique::server
