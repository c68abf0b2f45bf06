#pragma once

#include <sqlite3.h>

namespace oblique::server {

/// Gives the connection the SQL function `row_checksum(value, ...)`: the CRC-32 (as zlib computes
/// it) of its arguments, an integer from 0 to 2^32 - 1. Each argument counts with its type and
/// bytes: 'n' for NULL; 'i' and eight bytes, least first; 'r' and the eight bytes of the double,
/// likewise, a negative zero as zero; 't' or 'b', the length in eight bytes, and the bytes of the
/// text or blob. NULLs behind all other arguments do not count, so that a row keeps its checksum
/// when its table gets a column that it lacks. Throws StorageError.
void add_row_checksum(sqlite3* database);

}  // namespace oblique::server
