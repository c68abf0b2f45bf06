#pragma once

#include <memory>
#include <stdexcept>
#include <string>

#include <sqlite3.h>

namespace oblique::server {

/// A statement was refused or failed. The message says why, for people.
class QueryError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The statement itself is wrong: asking for it again gives the same.
class StatementError : public QueryError {
 public:
  using QueryError::QueryError;
};

/// Longest statement [bytes].
inline constexpr int kLongestSql = 1'000'000;

/// Lets statements on `database` read and compute, nothing else, with our functions beside
/// SQLite's, and bounds what one statement may be made of. What does not fit into memory is not put
/// into files.
void restrict_to_reading(sqlite3* database);

using StatementHandle = std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)>;

/// One statement that only reads. Throws StatementError: none or more than one, one that
/// writes, attaches or sets something, one with parameters, one that SQLite refuses; QueryError for
/// one that needs too much.
StatementHandle prepare_query(sqlite3* database, const std::string& sql);

/// Whether LIKE tells capitals apart in statements that are prepared on `database` from now on. In
/// modes S is stick and s slip, but SQLite's own LIKE takes one for the other. Throws QueryError
/// while a statement runs there.
void let_like_tell_capitals_apart(sqlite3* database, bool does);

/// What a failed call on `database` means to the one who asked. `code` is what SQLite returned.
QueryError failure(sqlite3* database, int code);

/// Throws what a statement that failed while it ran means: StatementError where its functions were
/// given what they do not take, else QueryError.
[[noreturn]] void throw_failure(sqlite3* database, int code);

}  // namespace oblique::server
