#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "server/care/merged_origins.h"
#include "server/care/merged_references.h"
#include "server/care/merged_studies.h"
#include "server/database/sqlite.h"
#include "server/store/rows/packed_row.h"
#include "server/store/rows/row_columns.h"
#include "server/store/rows/text_numbers.h"

namespace oblique::server {

/// The results of a database, one after the other.
class MergeSource {
 public:
  /// Both connections must have `row_checksum`. All must outlive it.
  MergeSource(sqlite3* source, sqlite3* target, const StudyPlaces& places);

  /// Goes to the next row; false when there is none. Throws StorageError.
  bool next();
  /// Numbers of texts of the present row become those of the target, where they are brought, so
  /// that outputs can be compared. Throws StorageError for one that is not there.
  void take_texts();
  /// The same with its model, its worker and the study that it was taken from.
  void take_references();

  PackedRow& row() { return row_; }
  /// Whether the row is as it was stored, as far as that can be told.
  bool is_sound() const { return is_sound_; }
  bool has_checksum() const { return has_checksum_; }
  /// Empty: the server failed the point.
  const std::string& solver_version() const { return solver_version_; }
  /// About how many there are.
  std::uint64_t rows() const { return rows_; }

 private:
  const int model_id_ = packed_column("model_id");
  const int worker_ = packed_column("worker");
  const int taken_from_ = packed_column("taken_from");
  const std::array<int, 3> text_columns_{packed_column("mode"), packed_column("major_mode"),
                                         packed_column("margin_event")};
  MergedModels models_;
  MergedWorkers workers_;
  MergedOrigins origins_;
  TextNumbers target_texts_;
  MergedTexts texts_;
  Statement read_;
  PackedRow row_;
  bool is_sound_ = false;
  bool has_checksum_ = false;
  std::string solver_version_;
  std::uint64_t rows_ = 0;
};

}  // namespace oblique::server
