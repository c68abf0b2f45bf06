#pragma once

#include <cstddef>
#include <cstdint>

#include "server/database/sqlite.h"

namespace oblique::server {

/// Deletes studies. A study is gone in one transaction, which also adds it to the table
/// `deletions`; its rows are deleted afterwards in small transactions, so that results are stored
/// meanwhile. All state is in the database: another process continues after a kill.
class StudyDeletion {
 public:
  /// Of a database of the present schema, which must outlive this.
  explicit StudyDeletion(sqlite3* database) : database_(database) {}

  /// Deletes the study except for its rows. In a transaction of the caller. Throws StorageError.
  void remove(std::uint64_t study_id);

  /// Whether rows of deleted studies may be left. Throws StorageError.
  bool has_rows() const;

  /// Deletes at most so many rows. In a transaction of the caller. Throws StorageError.
  void delete_rows(std::size_t most);

  /// Deletes the models and workers that no row refers to any more, if studies were deleted and all
  /// their rows are gone. Reads all rows of the file then. To be called before any of them is in
  /// use, in a transaction of the caller. Throws StorageError.
  void remove_orphans();

  std::uint64_t rows() const { return rows_; }  ///< deleted by this object

 private:
  std::size_t delete_some(const char* sql, std::uint64_t study_id, std::size_t most);

  sqlite3* database_;
  std::uint64_t rows_ = 0;
};

}  // namespace oblique::server
