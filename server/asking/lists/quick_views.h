#pragma once

#include <sqlite3.h>

namespace oblique::server {

/// Puts views `results` and `runs` over those of `database`, for this connection alone and without
/// a byte in the file: the same columns, with lists that our functions make. A database of another
/// schema, or whose views are not as we know them, stays as it is. Needs add_list_functions.
/// Throws StorageError.
void add_quick_views(sqlite3* database);

}  // namespace oblique::server
