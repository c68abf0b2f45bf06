#pragma once

#include <string>

#include "server/care/merge.h"
#include "server/care/merged_studies.h"
#include "server/database/sqlite.h"

namespace oblique::server {

/// Brings the rows of `results` of `source`, with the models and workers that they name, into
/// `target`, where studies are at `places`. A transaction must be open in the target; both
/// connections must have `row_checksum`. Throws MergeRefused and StorageError. Memory does not grow
/// with the number of rows.
void merge_rows(sqlite3* source, sqlite3* target, StudyPlaces& places, Merged& merged,
                const Merger::Progress& progress);

}  // namespace oblique::server
