#include "server/database/row_checksum.h"

#include <bit>
#include <cstdint>
#include <memory>
#include <new>
#include <string>

#include <zlib.h>

#include "server/database/sqlite.h"

namespace oblique::server {
namespace {

void append_word(std::string& bytes, std::uint64_t word) {
  for (unsigned shift = 0; shift < 64; shift += 8) {
    bytes += static_cast<char>((word >> shift) & 0xffU);
  }
}

void append_value(std::string& bytes, sqlite3_value* value) {
  const int type = sqlite3_value_type(value);
  switch (type) {
    case SQLITE_INTEGER:
      bytes += 'i';
      append_word(bytes, static_cast<std::uint64_t>(sqlite3_value_int64(value)));
      break;
    case SQLITE_FLOAT: {
      const double number = sqlite3_value_double(value);
      bytes += 'r';
      // SQLite may store a zero without its sign.
      append_word(bytes, number == 0.0 ? 0 : std::bit_cast<std::uint64_t>(number));
      break;
    }
    case SQLITE_TEXT:
    case SQLITE_BLOB: {
      const void* data = sqlite3_value_blob(value);
      const auto size = static_cast<std::size_t>(sqlite3_value_bytes(value));
      bytes += type == SQLITE_TEXT ? 't' : 'b';
      append_word(bytes, size);
      bytes.append(size == 0 ? "" : static_cast<const char*>(data), size);
      break;
    }
    default:
      bytes += 'n';
  }
}

void row_checksum(sqlite3_context* context, int count, sqlite3_value** values) {
  auto& bytes = *static_cast<std::string*>(sqlite3_user_data(context));  // kept: it has grown once
  bytes.clear();
  while (count > 0 && sqlite3_value_type(values[count - 1]) == SQLITE_NULL) {
    --count;
  }
  try {
    for (int i = 0; i < count; ++i) {
      append_value(bytes, values[i]);
    }
  } catch (const std::bad_alloc&) {
    sqlite3_result_error_nomem(context);
    return;
  }
  const uLong sum =
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<z_size_t>(bytes.size()));
  sqlite3_result_int64(context, static_cast<sqlite3_int64>(sum));
}

}  // namespace

void add_row_checksum(sqlite3* database) {
  auto buffer = std::make_unique<std::string>();
  constexpr int kAnyNumber = -1;
  // SQLite owns the buffer from here on, also when this fails.
  const int code = sqlite3_create_function_v2(
      database, "row_checksum", kAnyNumber, SQLITE_UTF8 | SQLITE_DETERMINISTIC, buffer.release(),
      row_checksum, nullptr, nullptr, [](void* bytes) { delete static_cast<std::string*>(bytes); });
  if (code != SQLITE_OK) {
    throw StorageError(std::string("no checksums can be computed: ") + sqlite3_errmsg(database));
  }
}

}  // namespace oblique::server
