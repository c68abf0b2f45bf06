#include "server/reading/query_values.h"

#include "proto/text.h"

namespace oblique::server {
namespace {

/// Bytes of `size` others as x'0F..'.
std::uint64_t hexadecimal_bytes(std::uint64_t size) {
  return 2 * size + 3;
}

/// Gives the bytes of a text or blob to `take(std::string_view)`.
template <typename Take>
Copied copy_bytes(sqlite3_stmt* statement, int column, std::uint64_t most_bytes, const Take& take) {
  const bool is_text = sqlite3_column_type(statement, column) == SQLITE_TEXT;
  // Asked first: a zeroblob has its size before it has its bytes.
  const auto size = static_cast<std::uint64_t>(sqlite3_column_bytes(statement, column));
  if ((is_text ? size : hexadecimal_bytes(size)) > most_bytes) {
    return Copied::kTooLarge;
  }
  const void* data = sqlite3_column_blob(statement, column);
  if (data == nullptr && size > 0) {
    return Copied::kNoMemory;
  }
  const std::string_view bytes(size == 0 ? "" : static_cast<const char*>(data), size);
  if (is_text && protocol::is_utf8(bytes)) {
    take(bytes);
    return Copied::kYes;
  }
  if (hexadecimal_bytes(size) > most_bytes) {
    return Copied::kTooLarge;
  }
  take(hexadecimal(bytes));
  return Copied::kYes;
}

}  // namespace

std::string hexadecimal(std::string_view bytes) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string text;
  text.reserve(hexadecimal_bytes(bytes.size()));
  text = "x'";
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    text += kDigits[byte >> 4U];
    text += kDigits[byte & 0xfU];
  }
  text += '\'';
  return text;
}

Copied copy_value(sqlite3_stmt* statement, int column, std::uint64_t most_bytes,
                  protocol::Value& value) {
  value.Clear();
  switch (sqlite3_column_type(statement, column)) {
    case SQLITE_INTEGER:
      value.set_integer(sqlite3_column_int64(statement, column));
      return Copied::kYes;
    case SQLITE_FLOAT:
      value.set_real(sqlite3_column_double(statement, column));
      return Copied::kYes;
    case SQLITE_NULL:
      return Copied::kYes;
    default:
      return copy_bytes(statement, column, most_bytes,
                        [&value](std::string_view text) { value.set_text(std::string(text)); });
  }
}

Copied copy_value(sqlite3_stmt* statement, int column, std::uint64_t most_bytes,
                  protocol::ChunkWriter& rows) {
  switch (sqlite3_column_type(statement, column)) {
    case SQLITE_INTEGER:
      rows.integer(sqlite3_column_int64(statement, column));
      return Copied::kYes;
    case SQLITE_FLOAT:
      rows.real(sqlite3_column_double(statement, column));
      return Copied::kYes;
    case SQLITE_NULL:
      rows.null();
      return Copied::kYes;
    default:
      return copy_bytes(statement, column, most_bytes,
                        [&rows](std::string_view text) { rows.text(text); });
  }
}

}  // namespace oblique::server
