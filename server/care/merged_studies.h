#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "server/care/merge.h"
#include "server/database/sqlite.h"

namespace oblique::server {

/// Where a study of a database that is merged goes.
struct StudyPlace {
  std::uint64_t id;  ///< in the target
  std::string name;  ///< there
  bool is_new;
  std::uint64_t points;
  std::uint64_t points_in_source;  ///< numbers of its points are lower
  /// Of the results that the target had; empty: it had none, and rows of any version may come.
  std::string solver_version;
  bool mixes_versions;
  bool has_grown = false;  ///< the source had more points of it
  std::uint64_t rows_changed = 0;
};

/// By the study's number in the database that is merged.
using StudyPlaces = std::map<std::uint64_t, StudyPlace>;

/// Makes the studies of `source` that `target` lacks and gives the place of each. A transaction
/// must be open in the target; both connections must have `row_checksum`. Throws MergeRefused,
/// naming every study that cannot be placed, and StorageError for a damaged one. The message does
/// not name the source.
StudyPlaces place_studies(sqlite3* source, sqlite3* target, const MergeSettings& settings,
                          Merged& merged);

/// Says of studies that got rows whether they are done, and brings what the source has of points
/// that failed before.
void settle_studies(sqlite3* source, sqlite3* target, const StudyPlaces& places);

}  // namespace oblique::server
