#include "server/database/row_checksum.h"

#include <array>
#include <bit>
#include <memory>
#include <new>

#include <zlib.h>

#include "server/database/sqlite.h"

namespace oblique::server {
namespace {

void add_value(RowChecksum& checksum, sqlite3_value* value) {
  const int type = sqlite3_value_type(value);
  switch (type) {
    case SQLITE_INTEGER:
      checksum.add(std::int64_t{sqlite3_value_int64(value)});
      break;
    case SQLITE_FLOAT:
      checksum.add(sqlite3_value_double(value));
      break;
    case SQLITE_TEXT:
    case SQLITE_BLOB: {
      const void* data = sqlite3_value_blob(value);
      const auto size = static_cast<std::size_t>(sqlite3_value_bytes(value));
      const std::string_view bytes(size == 0 ? "" : static_cast<const char*>(data), size);
      type == SQLITE_TEXT ? checksum.add(bytes) : checksum.add_blob(bytes);
      break;
    }
    default:
      checksum.add_null();
  }
}

void row_checksum(sqlite3_context* context, int count, sqlite3_value** values) {
  auto& checksum = *static_cast<RowChecksum*>(sqlite3_user_data(context));
  checksum.clear();
  try {
    for (int i = 0; i < count; ++i) {
      add_value(checksum, values[i]);
    }
  } catch (const std::bad_alloc&) {
    sqlite3_result_error_nomem(context);
    return;
  }
  sqlite3_result_int64(context, static_cast<sqlite3_int64>(checksum.sum()));
}

}  // namespace

void RowChecksum::clear() {
  bytes_.clear();
  end_ = 0;
}

void RowChecksum::add(std::int64_t value) {
  add_word('i', static_cast<std::uint64_t>(value));
}

void RowChecksum::add(double value) {
  // SQLite may store a zero without its sign.
  add_word('r', value == 0.0 ? 0 : std::bit_cast<std::uint64_t>(value));
}

void RowChecksum::add_word(char type, std::uint64_t word) {
  std::array<char, 9> bytes{type};
  for (std::size_t i = 1; i < bytes.size(); ++i) {
    bytes[i] = static_cast<char>(word & 0xffU);
    word >>= 8U;
  }
  bytes_.append(bytes.data(), bytes.size());
  end_ = bytes_.size();
}

void RowChecksum::add_bytes(char type, std::string_view bytes) {
  add_word(type, bytes.size());
  bytes_.append(bytes);
  end_ = bytes_.size();
}

std::uint32_t RowChecksum::sum() const {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes_.data()), static_cast<z_size_t>(end_)));
}

void add_row_checksum(sqlite3* database) {
  auto checksum = std::make_unique<RowChecksum>();
  constexpr int kAnyNumber = -1;
  // SQLite owns the object from here on, also when this fails.
  const int code = sqlite3_create_function_v2(
      database, "row_checksum", kAnyNumber, SQLITE_UTF8 | SQLITE_DETERMINISTIC, checksum.release(),
      row_checksum, nullptr, nullptr,
      [](void* object) { delete static_cast<RowChecksum*>(object); });
  if (code != SQLITE_OK) {
    throw StorageError(std::string("no checksums can be computed: ") + sqlite3_errmsg(database));
  }
}

}  // namespace oblique::server
