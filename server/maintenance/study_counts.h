#pragma once

#include <cstdint>

#include "server/database/sqlite.h"

namespace oblique::server {

/// Computes `settled_points` and `taken_points` of a study again from its rows, names the origins
/// that `origins` lacks, and returns how many points have a row or are left out by a filter. Throws
/// StorageError.
std::uint64_t count_rows_again(sqlite3* database, std::uint64_t study_id);

}  // namespace oblique::server
