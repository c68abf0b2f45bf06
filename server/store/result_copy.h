#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>

#include "server/database/sqlite.h"
#include "server/store/changes.h"
#include "server/store/rows/packed_row.h"
#include "server/store/rows/settled_runs.h"

namespace oblique::server {

/// Copies rows of one study to points of another, as TakeResults says: each is the same bits but
/// for its study, its point, and where it was taken from. A row that is not as it was stored is
/// left where it is: one whose checksum does not fit or is missing, as it is in rows that were
/// changed by hand, or whose model, worker or words are not there or not as they were stored.
class ResultCopy {
 public:
  /// All must outlive this.
  ResultCopy(sqlite3* database, SettledRuns& settled);

  /// Throws StorageError.
  void run(const TakeResults& change);
  void end(const EndTaking& change);

 private:
  std::string name_of(std::uint64_t study_id);
  void copy(const TakeResults& change, const SharedRun& run);
  bool is_sound();

  /// Which numbers of a table have a sound row; of each it is asked once a change.
  class SoundNumbers {
   public:
    SoundNumbers(sqlite3* database, const std::string& sql) : is_sound_(database, sql) {}
    bool has(const PackedValue& number);
    void forget() { known_.clear(); }

   private:
    Statement is_sound_;
    std::unordered_map<std::int64_t, bool> known_;
  };

  SettledRuns& settled_;
  Statement name_;
  Statement read_;
  Statement name_origin_;
  Statement count_;
  Statement end_;
  RowInsert insert_;
  PackedRow row_;
  RowChecksum checksum_;
  SoundNumbers models_;
  SoundNumbers workers_;
  SoundNumbers texts_;
};

}  // namespace oblique::server
