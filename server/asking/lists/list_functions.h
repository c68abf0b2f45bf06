#pragma once

#include <sqlite3.h>

namespace oblique::server {

/// Gives statements on `database` functions that make lists of results:
/// unpacked_peaks(packed), unpacked_pairs(packed, stride, second, decimals, decimals),
/// unpacked_phases(packed, duration) and list_member(list, member, where), the same as the views
/// and `->` do; see unpacking.h. NULL: the argument is NULL, or not as the server packs it, and
/// the views know what to make of it. Throws StorageError.
void add_list_functions(sqlite3* database);

}  // namespace oblique::server
