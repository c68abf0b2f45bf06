#include "server/database/sqlite.h"

#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <utility>

#include <sys/resource.h>
#include <zlib.h>

namespace oblique::server {
namespace {

constexpr const char* kAfterFailedSync =
    " (fsync). Nothing more is stored, and the server ends. Once the disk works, start the server "
    "again; running workers have kept all results that are not stored";

[[noreturn]] void fail(sqlite3* database, int code, const std::string& reason) {
  check_gone(database, code);
  switch (static_cast<unsigned>(code) & 0xffU) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      throw StorageBusy("another program has locked the database: " + reason);
    case SQLITE_ERROR:
    case SQLITE_CONSTRAINT:
    case SQLITE_MISMATCH:
    case SQLITE_TOOBIG:
      throw ChangeRefused("the database refused a statement: " + reason);
    default:
      throw StorageError("the database failed: " + reason);
  }
}

/// Returns SQLite's message for the last error, with the cause if a write reached a limit.
std::string error_text(sqlite3* database) {
  const int code = sqlite3_extended_errcode(database);
  const bool is_write = code == SQLITE_IOERR_WRITE || code == SQLITE_IOERR_SHMSIZE;
  rlimit size{};
  return std::string(sqlite3_errmsg(database)) +
         (is_write && getrlimit(RLIMIT_FSIZE, &size) == 0 && size.rlim_cur != RLIM_INFINITY
              ? ": the limit on file sizes (ulimit -f) is reached"
              : "");
}

/// Computes the CRC-32 of bytes that are added in small pieces. Buffers the pieces, because one
/// call of zlib takes as long as the checksum of some hundred bytes.
class Crc {
 public:
  void add(const void* bytes, std::size_t size) {
    if (size > buffer_.size() - used_) {
      flush();
    }
    if (size > buffer_.size()) {
      sum_ = crc32_z(sum_, static_cast<const Bytef*>(bytes), size);
    } else if (size > 0) {
      std::memcpy(buffer_.data() + used_, bytes, size);
      used_ += size;
    }
  }
  void add_word(char type, std::uint64_t word) {
    std::array<char, 9> bytes{type};
    for (std::size_t i = 1; i < bytes.size(); ++i) {
      bytes[i] = static_cast<char>(word & 0xffU);
      word >>= 8U;
    }
    add(bytes.data(), bytes.size());
  }
  void add_value(sqlite3_value* value) {
    switch (const int type = sqlite3_value_type(value); type) {
      case SQLITE_INTEGER:
        add_word('i', static_cast<std::uint64_t>(sqlite3_value_int64(value)));
        break;
      case SQLITE_FLOAT: {
        const double real = sqlite3_value_double(value);
        // 0.0 and -0.0 have the same checksum, because SQLite may drop the sign of a zero.
        add_word('r', real == 0.0 ? 0 : std::bit_cast<std::uint64_t>(real));
        break;
      }
      case SQLITE_TEXT:
      case SQLITE_BLOB: {
        const void* data = sqlite3_value_blob(value);
        const auto size = static_cast<std::size_t>(sqlite3_value_bytes(value));
        add_word(type == SQLITE_TEXT ? 't' : 'b', size);
        add(data, size);
        break;
      }
      default:
        add("n", 1);
    }
  }
  uLong sum() {
    flush();
    return sum_;
  }

 private:
  void flush() { sum_ = crc32_z(sum_, buffer_.data(), std::exchange(used_, 0)); }

  uLong sum_ = 0;
  std::size_t used_ = 0;
  std::array<Bytef, 2048> buffer_;
};

void row_checksum(sqlite3_context* context, int count, sqlite3_value** values) {
  Crc crc;
  for (int i = 0; i < count; ++i) {
    crc.add_value(values[i]);
  }
  sqlite3_result_int64(context, static_cast<sqlite3_int64>(crc.sum()));
}

}  // namespace

bool is_damage(int code) {
  const unsigned kind = static_cast<unsigned>(code) & 0xffU;
  return kind == SQLITE_CORRUPT || kind == SQLITE_NOTADB || code == SQLITE_IOERR_CORRUPTFS;
}

void check_gone(sqlite3* database, int code) {
  if (is_damage(code)) {
    throw StorageGone(std::string("the database failed: ") + sqlite3_errmsg(database) + kWayOut);
  }
  if (code == SQLITE_IOERR_FSYNC || code == SQLITE_IOERR_DIR_FSYNC) {
    const char* path = sqlite3_db_filename(database, "main");
    throw StorageGone(std::string("the disk failed to store changes of ") +
                      (path != nullptr ? path : "the database") + kAfterFailedSync);
  }
}

DatabaseHandle open_database(const std::string& path, int flags) {
  sqlite3* raw = nullptr;
  // SQLite need not lock the connection, because only one thread at a time uses it.
  const int code = sqlite3_open_v2(path.c_str(), &raw,
                                   flags | SQLITE_OPEN_EXRESCODE | SQLITE_OPEN_NOMUTEX, nullptr);
  DatabaseHandle database(raw);
  if (code != SQLITE_OK && raw != nullptr && sqlite3_system_errno(raw) == EACCES) {
    throw StorageError("cannot open the database " + path +
                       ": permission denied. Only its owner can read a new database; `chmod` lets "
                       "others read it");
  }
  if (code != SQLITE_OK) {
    throw StorageError("cannot open the database " + path + ": " +
                       (raw != nullptr ? sqlite3_errmsg(raw) : sqlite3_errstr(code)));
  }
  constexpr int kAnyNumber = -1;
  if (sqlite3_create_function_v2(raw, "row_checksum", kAnyNumber,
                                 SQLITE_UTF8 | SQLITE_DETERMINISTIC, nullptr, row_checksum, nullptr,
                                 nullptr, nullptr) != SQLITE_OK) {
    throw StorageError(std::string("cannot compute checksums: ") + sqlite3_errmsg(raw));
  }
  return database;
}

void execute(sqlite3* database, const std::string& sql) {
  const int code = sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) {
    fail(database, code, error_text(database));
  }
}

Statement::Statement(sqlite3* database, std::string_view sql) : database_(database) {
  sqlite3_stmt* raw = nullptr;
  check(sqlite3_prepare_v3(database, sql.data(), static_cast<int>(sql.size()),
                           SQLITE_PREPARE_PERSISTENT, &raw, nullptr));
  statement_.reset(raw);
}

void Statement::check(int code) const {
  if (code != SQLITE_OK) {
    fail(database_, code, sqlite3_errmsg(database_));
  }
}

void Statement::bind(int index, double value) {
  check(sqlite3_bind_double(statement_.get(), index, value));
}

void Statement::bind(int index, std::string_view text) {
  check(sqlite3_bind_text64(statement_.get(), index, text.data(), text.size(), SQLITE_TRANSIENT,
                            SQLITE_UTF8));
}

void Statement::bind_lasting(int index, std::string_view text) {
  check(sqlite3_bind_text64(statement_.get(), index, text.data(), text.size(), SQLITE_STATIC,
                            SQLITE_UTF8));
}

void Statement::bind(int index, Blob blob) {
  check(sqlite3_bind_blob64(statement_.get(), index, blob.bytes.data(), blob.bytes.size(),
                            SQLITE_TRANSIENT));
}

void Statement::bind_column(int index, const Statement& row, int column) {
  check(sqlite3_bind_value(statement_.get(), index,
                           sqlite3_column_value(row.statement_.get(), column)));
}

bool Statement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) {
    return true;
  }
  if (code != SQLITE_DONE) {
    const std::string reason = error_text(database_);
    reset();
    fail(database_, code, reason);
  }
  return false;
}

void Statement::run() {
  step();
  reset();
}

void Statement::reset() {
  sqlite3_reset(statement_.get());
  sqlite3_clear_bindings(statement_.get());
}

std::string_view Statement::bytes(int column) const {
  const void* bytes = sqlite3_column_blob(statement_.get(), column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
  return size == 0 ? std::string_view() : std::string_view(static_cast<const char*>(bytes), size);
}

Transaction::Transaction(sqlite3* database) : database_(database) {
  execute(database_, "BEGIN IMMEDIATE");
}

Transaction::~Transaction() {
  // SQLite may have rolled back already, for example when the disk was full.
  if (open_ && sqlite3_get_autocommit(database_) == 0) {
    sqlite3_exec(database_, "ROLLBACK", nullptr, nullptr, nullptr);
  }
}

void Transaction::commit() {
  execute(database_, "COMMIT");
  open_ = false;
}

namespace {

std::int64_t pragma(sqlite3* database, const std::string& name) {
  Statement statement(database, "PRAGMA " + name);
  return statement.step() ? statement.integer(0) : 0;
}

}  // namespace

DatabaseKind identify(sqlite3* database, const std::string& path) {
  std::int64_t application_id = 0;
  std::int64_t version = 0;
  bool has_tables = false;
  try {
    application_id = pragma(database, "application_id");
    version = pragma(database, "user_version");
    has_tables = Statement(database, "SELECT 1 FROM sqlite_schema").step();
  } catch (const StorageBusy&) {
    throw;
  } catch (const StorageError&) {
    const int code = sqlite3_errcode(database);
    throw StorageError(code == SQLITE_NOTADB
                           ? path + " is not a database"
                           : "cannot read the database " + path + ": " + error_text(database) +
                                 (is_damage(code) ? kWayOut : ""));
  }
  if (application_id == 0 && version == 0 && !has_tables) {
    return DatabaseKind::kEmpty;
  }
  if (application_id != kApplicationId) {
    throw StorageError(path + " is a database of another program (application id " +
                       std::to_string(application_id) + "): choose another file");
  }
  if (version != kSchemaVersion) {
    throw StorageError(path + " has schema " + std::to_string(version) +
                       ", and this version of oblique has schema " +
                       std::to_string(kSchemaVersion) + ": export its results with the " +
                       (version < kSchemaVersion ? "older" : "newer") +
                       " version that wrote it (oblique query STUDY --db FILE --format csv), or "
                       "solve its studies again into a new file");
  }
  return DatabaseKind::kOurs;
}

}  // namespace oblique::server
