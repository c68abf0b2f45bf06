#include "server/query/query_rules.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "server/database/sqlite.h"
#include "server/query/sql_text.h"

namespace oblique::server {
namespace {

constexpr const char* kOnlyReads = "this only reads";

/// Pragmas that only return values.
bool is_harmless_pragma(std::string_view name) {
  constexpr std::array<std::string_view, 6> kAboutTables{
      "table_info", "table_xinfo", "table_list", "index_list", "index_info", "foreign_key_list"};
  return std::ranges::find(kAboutTables, name) != kAboutTables.end();
}

/// False for functions that reach out of the database, use addresses of this process, run SQL, or
/// belong to virtual tables that our databases do not have.
bool is_harmless_function(std::string_view name) {
  constexpr std::array<std::string_view, 16> kOthers{
      "load_extension", "fts3_tokenizer", "fts5",       "fts5_source_id",
      "bm25",           "highlight",      "match",      "matchinfo",
      "offsets",        "optimize",       "rtreecheck", "rtreedepth",
      "rtreenode",      "snippet",        "sqlite_log", "edit"};
  return std::ranges::find(kOthers, name) == kOthers.end();
}

/// SQLite's authorizer: allows only reading and computing. Applies inside views too.
int authorize(void*, int action, const char* first, const char* second, const char*, const char*) {
  switch (action) {
    case SQLITE_SELECT:
    case SQLITE_READ:
    case SQLITE_RECURSIVE:
      return SQLITE_OK;
    case SQLITE_FUNCTION:
      return second != nullptr && is_harmless_function(second) ? SQLITE_OK : SQLITE_DENY;
    case SQLITE_PRAGMA:
      return first != nullptr && is_harmless_pragma(first) ? SQLITE_OK : SQLITE_DENY;
    default:
      return SQLITE_DENY;
  }
}

}  // namespace

std::int64_t time_limit_of(const protocol::QueryRequest& request) {
  const std::uint64_t most_ms{kLongestTimeLimit_ms};
  const std::uint64_t asked_ms = request.time_limit_ms();
  return asked_ms == 0 ? QueryLimits().time_limit_ms
                       : static_cast<std::int64_t>(std::min(asked_ms, most_ms));
}

std::string took_too_long(std::int64_t time_limit_ms) {
  return fmt::format(
      "the query took too long (more than {} s): narrow it, as with WHERE or LIMIT, or give it "
      "more time with --timeout",
      static_cast<double>(time_limit_ms) / 1000.0);
}

void restrict_to_reading(sqlite3* database) {
  execute(database, "PRAGMA temp_store = MEMORY; PRAGMA case_sensitive_like = ON");
  constexpr std::array<std::pair<int, int>, 9> kLimits{{{SQLITE_LIMIT_SQL_LENGTH, kLongestSql},
                                                        {SQLITE_LIMIT_COLUMN, 1000},
                                                        {SQLITE_LIMIT_EXPR_DEPTH, 1000},
                                                        {SQLITE_LIMIT_COMPOUND_SELECT, 100},
                                                        {SQLITE_LIMIT_VDBE_OP, 1'000'000},
                                                        {SQLITE_LIMIT_FUNCTION_ARG, 100},
                                                        {SQLITE_LIMIT_ATTACHED, 0},
                                                        {SQLITE_LIMIT_LIKE_PATTERN_LENGTH, 1000},
                                                        {SQLITE_LIMIT_WORKER_THREADS, 0}}};
  for (const auto& [limit, most] : kLimits) {
    sqlite3_limit(database, limit, most);
  }
  // The schema stays trusted: SQLite 3.40 treats json_extract, which our views use, as unsafe.
  // Without DQS_DML an unknown name in double quotes is an error instead of a text.
  constexpr std::array<std::pair<int, int>, 5> kSwitches{
      {{SQLITE_DBCONFIG_DEFENSIVE, 1},
       {SQLITE_DBCONFIG_DQS_DML, 0},
       {SQLITE_DBCONFIG_ENABLE_FTS3_TOKENIZER, 0},
       {SQLITE_DBCONFIG_ENABLE_LOAD_EXTENSION, 0},
       {SQLITE_DBCONFIG_ENABLE_TRIGGER, 0}}};
  for (const auto& [name, value] : kSwitches) {
    sqlite3_db_config(database, name, value, nullptr);
  }
  // SQLite creates these virtual tables at their first use, which would be refused later.
  execute(database, "SELECT 1 FROM json_each('[]'), json_tree('[]')");
  add_functions(database);
  sqlite3_set_authorizer(database, &authorize, nullptr);
}

StatementHandle prepare_query(sqlite3* database, const std::string& sql) {
  if (sql.size() > kLongestSql) {
    throw StatementError("the statement is longer than " + std::to_string(kLongestSql) + " bytes");
  }
  sqlite3_stmt* raw = nullptr;
  const char* tail = nullptr;
  const int code =
      sqlite3_prepare_v2(database, sql.c_str(), static_cast<int>(sql.size()) + 1, &raw, &tail);
  StatementHandle statement(raw, &sqlite3_finalize);
  const int primary = static_cast<int>(static_cast<unsigned>(code) & 0xffU);
  const std::string reason = code == SQLITE_OK ? "" : sqlite3_errmsg(database);
  if (primary == SQLITE_AUTH || reason.starts_with("cannot modify ")) {  // the latter of a view
    throw StatementError(fmt::format("{}: {}", kOnlyReads, reason));
  }
  if (primary == SQLITE_ERROR) {
    throw StatementError(reason);
  }
  if (primary != SQLITE_OK) {
    throw failure(database, code);
  }
  if (statement == nullptr) {
    throw StatementError("there is no statement");
  }
  if (std::string_view(tail).find_first_not_of(" \t\r\n;") != std::string_view::npos) {
    throw StatementError("one statement at a time: something follows the first");
  }
  if (sqlite3_stmt_readonly(raw) == 0) {
    throw StatementError(kOnlyReads);
  }
  if (sqlite3_bind_parameter_count(raw) > 0) {
    throw StatementError(
        "the statement has a parameter (?, :x, @x or $x), which has no value: write the value "
        "itself, a text in single quotes");
  }
  return statement;
}

QueryError failure(sqlite3* database, int code) {
  switch (static_cast<unsigned>(code) & 0xffU) {
    case SQLITE_NOMEM: {
      const std::int64_t limit = sqlite3_hard_heap_limit64(-1);
      return QueryError("the query needs more memory than " +
                        (limit > 0 ? fmt::format("the {} MiB allowed", limit >> 20U) : "there is") +
                        ": sort, group or gather less, as with WHERE or LIMIT");
    }
    case SQLITE_TOOBIG:
      return QueryError(
          fmt::format("a text, a blob or a row of the query has more than the {} MiB allowed",
                      sqlite3_limit(database, SQLITE_LIMIT_LENGTH, -1) >> 20));
    default:
      return QueryError(std::string("the query failed: ") + sqlite3_errmsg(database));
  }
}

}  // namespace oblique::server
