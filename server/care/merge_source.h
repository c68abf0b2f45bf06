#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "server/care/merged_studies.h"
#include "server/database/sqlite.h"
#include "server/store/rows/packed_row.h"

namespace oblique::server {

/// The results of a database of this or an earlier schema, one after the other as packed rows.
class MergeSource {
 public:
  /// Both connections must have `row_checksum`, and the source `model_definition`. All must outlive
  /// it.
  static std::unique_ptr<MergeSource> of(sqlite3* source, sqlite3* target,
                                         const StudyPlaces& places);
  virtual ~MergeSource() = default;

  /// Goes to the next row; false when there is none. Throws StorageError.
  virtual bool next() = 0;
  /// Numbers of texts of the present row become those of the target, where they are brought, so
  /// that outputs can be compared. Throws StorageError for one that is not there.
  virtual void take_texts() = 0;
  /// The same with its model, its worker and the study that it was taken from.
  virtual void take_references() = 0;

  PackedRow& row() { return row_; }
  /// Whether the row is as it was stored, as far as that can be told.
  bool is_sound() const { return is_sound_; }
  bool has_checksum() const { return has_checksum_; }
  /// Empty: the server failed the point.
  const std::string& solver_version() const { return solver_version_; }
  /// About how many there are.
  std::uint64_t rows() const { return rows_; }

 protected:
  PackedRow row_;
  bool is_sound_ = false;
  bool has_checksum_ = false;
  std::string solver_version_;
  std::uint64_t rows_ = 0;
};

}  // namespace oblique::server
