#pragma once

#include <cstdint>

#include "server/database/sqlite.h"
#include "server/study/interval_set.h"
#include "server/study/study_table.h"

namespace oblique::server {

/// Computes `completed_ranges` and `reused_points` of a study again: points that have a row, and
/// those of `noted` that its filter leaves out. A study with all points becomes done, a done one
/// without them running. Throws StorageError.
void count_again(sqlite3* database, std::uint64_t study_id, const StudyTable& table,
                 const IntervalSet& noted);

}  // namespace oblique::server
