#pragma once

#include <sqlite3.h>

namespace oblique::server {

/// Beside the quick view `results`, the same rows with modes looked up where a question names them.
/// SQLite 3.40 keeps the joins that a mode takes even under aggregates that need none.
constexpr const char* kUnjoinedResults = "results_without_joins";

/// Puts views `results` and `runs` over those of `database`, for this connection alone and without
/// a byte in the file: the same columns, with lists that our functions make. A database of another
/// schema, or whose views are not as we know them, stays as it is. Needs add_list_functions.
/// Throws StorageError.
void add_quick_views(sqlite3* database);

/// Whether the connection has the view kUnjoinedResults. Throws StorageError.
bool has_unjoined_results(sqlite3* database);

}  // namespace oblique::server
