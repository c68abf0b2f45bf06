#pragma once

#include <cstdint>
#include <string>

#include "server/database/sqlite.h"
#include "server/store/changes.h"
#include "server/store/clearing.h"
#include "server/store/rows/packed_row.h"
#include "server/store/rows/settled_runs.h"

namespace oblique::server {

/// Copies rows of one study to points of another, as TakeResults says: each is the same bits but
/// for its study, its point, and where it was taken from.
class ResultCopy {
 public:
  /// All must outlive this.
  ResultCopy(sqlite3* database, SettledRuns& settled, Clearing& clearing);

  /// Throws StorageError.
  void run(const TakeResults& change);
  void end(const EndTaking& change);

 private:
  std::string name_of(std::uint64_t study_id);
  void copy(const TakeResults& change, const SharedRun& run);

  SettledRuns& settled_;
  Clearing& clearing_;
  Statement name_;
  Statement read_;
  Statement name_origin_;
  Statement count_;
  Statement end_;
  RowInsert insert_;
  PackedRow row_;
};

}  // namespace oblique::server
