#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/database/sqlite.h"
#include "server/maintenance/merge.h"

namespace oblique::server {

/// Where a study of a merged database goes.
struct StudyPlace {
  std::uint64_t source_id;
  std::uint64_t id;                ///< in the target
  std::string name;                ///< in the target
  std::uint64_t points_in_source;  ///< numbers of its points are lower
  /// Of the results in the target; empty: it has none, and rows of any version may come.
  std::string solver_version;
};

/// Inserts, renames and grows studies of main so that each of `source`, an attached database, has a
/// place. A transaction must be open; the connection must have `row_checksum`. Throws MergeRefused,
/// naming every study without a place, and StorageError for one that no server would have stored.
std::vector<StudyPlace> place_studies(sqlite3* database, const MergeSettings& settings,
                                      Merged& merged);

}  // namespace oblique::server
