#pragma once

#include <concepts>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

#include <sqlite3.h>

namespace oblique::server {

/// A database could not be opened, read or written. The message names the file or statement and has
/// SQLite's reason.
class StorageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The database file was deleted, renamed or replaced while it was open, it is damaged, or a sync
/// failed. Nothing can be stored until the program is restarted: after a failed sync Linux marks
/// the unwritten pages as clean, so a second sync succeeds without having stored them.
class StorageGone : public StorageError {
 public:
  using StorageError::StorageError;
};

/// Another program has locked the database for longer than the connection waits.
class StorageBusy : public StorageError {
 public:
  using StorageError::StorageError;
};

/// A change contradicts the file, so it fails at every attempt, unlike with a full disk.
class ChangeRefused : public StorageError {
 public:
  using StorageError::StorageError;
};

/// Sentence after the reason for which a damaged file cannot be used: how to save its results.
inline constexpr const char* kWayOut =
    ": the file is damaged. `oblique check --db FILE` lists the faults, and `oblique backup "
    "SAVED.db --db FILE --salvage` saves all readable results; the other points are solved again";

/// Returns whether SQLite's result code reports a damaged file or file system.
bool is_damage(int code);

/// If `code` is the extended result code of a failed fsync or reports damage, throws StorageGone.
/// The message names the file of the connection or the remedy.
void check_gone(sqlite3* database, int code);

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close_v2(database); }
};
using DatabaseHandle = std::unique_ptr<sqlite3, CloseDatabase>;

/// Opens `path` with SQLITE_OPEN_... `flags`. Throws StorageError.
///
/// The connection has the SQL function `row_checksum(value, ...)`: the CRC-32, as zlib computes it,
/// of its arguments. The bytes of a value are its type and contents. NULL: 'n'. Integer: 'i' and
/// eight bytes, least significant first. Real: 'r' and the eight bytes of the double in the same
/// order; negative zero as zero. Text or blob: 't' or 'b', the length in eight bytes, and its
/// bytes.
DatabaseHandle open_database(const std::string& path, int flags);

/// Runs statements that return no rows. Throws StorageError.
void execute(sqlite3* database, const std::string& sql);

/// Bytes that are bound as a blob.
struct Blob {
  std::string_view bytes;
};

/// One prepared statement. Bindings count from 1, columns from 0, as in SQLite.
class Statement {
 public:
  /// Throws StorageError if `sql` does not compile.
  Statement(sqlite3* database, std::string_view sql);

  void bind(int index, double value);  ///< a NaN is stored as NULL
  void bind(int index, std::string_view text);
  void bind(int index, Blob blob);
  template <std::integral Integer>
  void bind(int index, Integer value) {
    check(sqlite3_bind_int64(statement_.get(), index, static_cast<std::int64_t>(value)));
  }
  /// Binds a text without copying it. The text must not change until the statement is reset.
  void bind_lasting(int index, std::string_view text);
  /// Binds the value in column `column` of `row`, with its type.
  void bind_column(int index, const Statement& row, int column);

  /// Binds the values to the parameters 1, 2 and so on.
  template <class... Values>
  void bind_all(const Values&... values) {
    int index = 0;
    (bind(++index, values), ...);
  }

  /// Moves to the next row. Returns false after the last row. Throws StorageError.
  bool step();
  /// Runs a statement that returns no rows and makes it ready for the next bindings.
  void run();
  /// Clears the bindings and makes the statement ready to run again.
  void reset();

  int columns() const { return sqlite3_column_count(statement_.get()); }
  bool is_null(int column) const { return type(column) == SQLITE_NULL; }
  /// Returns the type of a value, such as SQLITE_INTEGER.
  int type(int column) const { return sqlite3_column_type(statement_.get(), column); }
  std::int64_t integer(int column) const { return sqlite3_column_int64(statement_.get(), column); }
  std::uint64_t number(int column) const { return static_cast<std::uint64_t>(integer(column)); }
  double real(int column) const { return sqlite3_column_double(statement_.get(), column); }
  /// Returns the bytes of a text or blob.
  std::string text(int column) const { return std::string(bytes(column)); }
  /// Returns the bytes without a copy. They are valid until the next call of `step` or `reset`.
  std::string_view bytes(int column) const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };
  void check(int code) const;

  sqlite3* database_;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

/// Runs one statement that returns no rows, with the values bound. Throws StorageError.
template <class... Values>
void execute_with(sqlite3* database, std::string_view sql, const Values&... values) {
  Statement statement(database, sql);
  statement.bind_all(values...);
  statement.run();
}

/// A transaction. The destructor rolls it back unless it was committed.
class Transaction {
 public:
  explicit Transaction(sqlite3* database);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;

  /// Commits. If that fails, rolls back and throws StorageError.
  void commit();

 private:
  sqlite3* database_;
  bool open_ = true;
};

/// Values of PRAGMA application_id and PRAGMA user_version in our databases.
inline constexpr std::int32_t kApplicationId = 0x6f626c71;  // "oblq"
inline constexpr std::int32_t kSchemaVersion = 14;

enum class DatabaseKind { kEmpty, kOurs };

/// Returns whether an open database is empty or ours. Throws StorageError, with the reason, for a
/// foreign file or another schema. Error messages contain `path`.
DatabaseKind identify(sqlite3* database, const std::string& path);

}  // namespace oblique::server
