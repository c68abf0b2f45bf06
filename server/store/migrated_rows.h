#pragma once

#include <cstdint>
#include <functional>

#include "server/database/sqlite.h"

namespace oblique::server {

/// What became of the rows of a table.
struct MigratedRows {
  std::uint64_t kept = 0;
  std::uint64_t left_out = 0;  ///< they were not as they were stored
};

/// Packs the rows of `results_7`, a table `results` of schema 7, into `packed_results`, and counts
/// them in `settled_points`. A study that was done and lacks rows then is running. A transaction
/// must be open; memory does not grow with the rows. `progress` is called now and then with how
/// many were looked at. Throws StorageError.
MigratedRows migrate_rows(sqlite3* database,
                          const std::function<void(std::uint64_t looked_at)>& progress);

}  // namespace oblique::server
