#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include <sqlite3.h>

namespace oblique::server {

/// The checksum of a row: the CRC-32 (as zlib computes it) of its values. The bytes of a value are
/// its type and contents. NULL: 'n'. Integer: 'i' and eight bytes, least significant first. Real:
/// 'r' and the eight bytes of the double in the same order; negative zero as zero. Text or blob:
/// 't' or 'b', the length in eight bytes, and its bytes. NULLs after the last other value are left
/// out, so that a row keeps its checksum when its table gets a new column.
class RowChecksum {
 public:
  void clear();
  void add_null() { bytes_ += 'n'; }
  void add(std::int64_t value);
  void add(double value);
  void add(std::string_view text) { add_bytes('t', text); }
  void add_blob(std::string_view blob) { add_bytes('b', blob); }
  std::uint32_t sum() const;

 private:
  void add_word(char type, std::uint64_t word);
  void add_bytes(char type, std::string_view bytes);

  std::string bytes_;    // keeps its capacity
  std::size_t end_ = 0;  // after the last value that is not NULL
};

/// Adds the SQL function `row_checksum(value, ...)` to the connection: the checksum of its
/// arguments, an integer from 0 to 2^32 - 1. Throws StorageError.
void add_row_checksum(sqlite3* database);

}  // namespace oblique::server
