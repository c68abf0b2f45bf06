#pragma once

#include <cstdint>

#include "server/database/sqlite.h"

namespace oblique::server {

/// Computes `reused_points` of a study from its rows. Sets its state to done if all points are
/// completed, and from done to running if not. To be called after its completed ranges were counted
/// again. Throws StorageError.
void count_reused_and_set_state(sqlite3* database, std::uint64_t study_id);

}  // namespace oblique::server
