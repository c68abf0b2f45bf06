#pragma once

#include <cstdint>

#include "server/database/sqlite.h"

namespace oblique::server {

/// After the completed ranges of a study were counted again: computes `reused_points` from its
/// rows. If all points are completed it becomes done, else a done one is running again. Throws
/// StorageError.
void count_reused_and_set_state(sqlite3* database, std::uint64_t study_id);

}  // namespace oblique::server
