#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include <sqlite3.h>

namespace oblique::server {

/// A database could not be opened, read or written. The message names the file or statement and
/// what SQLite said.
class StorageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The files of the database were deleted, renamed or replaced while it was open. Nothing that is
/// written from then on is kept, and no later attempt will be.
class StorageGone : public StorageError {
 public:
  using StorageError::StorageError;
};

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close_v2(database); }
};
using DatabaseHandle = std::unique_ptr<sqlite3, CloseDatabase>;

/// Opens `path` with SQLITE_OPEN_... `flags`. Throws StorageError.
DatabaseHandle open_database(const std::string& path, int flags);

/// Runs statements that return no rows. Throws StorageError.
void execute(sqlite3* database, const std::string& sql);

/// One prepared statement. Bindings count from 1, columns from 0, as in SQLite.
class Statement {
 public:
  /// Throws StorageError when `sql` does not compile.
  Statement(sqlite3* database, std::string_view sql);

  void bind(int index, std::int64_t value);
  void bind(int index, std::uint64_t value);
  void bind(int index, double value);  ///< a NaN is stored as NULL
  void bind(int index, std::string_view text);
  /// The same without a copy: the text must stay where it is until the statement was reset.
  void bind_lasting(int index, std::string_view text);
  void bind_blob(int index, std::string_view bytes);
  void bind_null(int index);
  /// The value, of whatever type, that another statement's row has in that column.
  void bind_column(int index, const Statement& row, int column);

  /// Advances: true when there is a row. Throws StorageError.
  bool step();
  /// Runs a statement without rows and makes it ready for the next bindings.
  void run();
  /// Makes the statement ready to run again. Bindings are cleared.
  void reset();

  int columns() const;
  int type(int column) const;  ///< SQLITE_INTEGER and so on
  bool is_null(int column) const;
  std::int64_t integer(int column) const;
  double real(int column) const;
  std::string text(int column) const;  ///< bytes of a text or blob
  /// The same without a copy, until the statement goes on.
  std::string_view bytes(int column) const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };
  void check(int code) const;

  sqlite3* database_;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

/// A transaction that rolls back unless it was committed.
class Transaction {
 public:
  explicit Transaction(sqlite3* database);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;

  /// Throws StorageError; the transaction is rolled back then.
  void commit();

 private:
  sqlite3* database_;
  bool open_ = true;
};

/// The schema that this program writes, and the marks that tell its databases from others.
inline constexpr std::int32_t kApplicationId = 0x6f626c71;  // "oblq"
inline constexpr std::int32_t kSchemaVersion = 11;

enum class DatabaseKind { kEmpty, kOurs };

/// Says whether an open database is empty or ours. Throws StorageError naming what was found when
/// it is a foreign file or has another schema. `path` is for the messages.
DatabaseKind identify(sqlite3* database, const std::string& path);

/// Throws StorageError when `path` is there and is not a regular file.
void check_path(const std::string& path);

}  // namespace oblique::server
