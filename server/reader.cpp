#include "server/reader.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <string_view>

namespace oblique::server {
namespace {

constexpr int kBusyTimeout_ms = 2000;
constexpr int kLongestSql = 1'000'000;
/// Instructions of SQLite's machine between two looks at the clock.
constexpr int kInstructionsPerLook = 10'000;

/// Pragmas that only tell something, when they have no argument or name a table.
bool is_harmless_pragma(std::string_view name, const char* argument) {
  constexpr std::array<std::string_view, 6> kAboutTables{
      "table_info", "table_xinfo", "table_list", "index_list", "index_info", "foreign_key_list"};
  constexpr std::array<std::string_view, 4> kPlain{"user_version", "application_id",
                                                   "compile_options", "page_count"};
  const auto has = [name](const auto& names) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  return has(kAboutTables) || (argument == nullptr && has(kPlain));
}

/// Lets statements read and compute, nothing else.
int authorize(void*, int action, const char* first, const char* second, const char*, const char*) {
  switch (action) {
    case SQLITE_SELECT:
    case SQLITE_READ:
    case SQLITE_RECURSIVE:
      return SQLITE_OK;
    case SQLITE_FUNCTION:
      return second != nullptr && std::string_view(second) == "load_extension" ? SQLITE_DENY
                                                                               : SQLITE_OK;
    case SQLITE_PRAGMA:
      return first != nullptr && is_harmless_pragma(first, second) ? SQLITE_OK : SQLITE_DENY;
    default:
      return SQLITE_DENY;
  }
}

bool is_utf8(std::string_view text) {
  std::size_t i = 0;
  while (i < text.size()) {
    const auto lead = static_cast<unsigned char>(text[i]);
    const std::size_t length = lead < 0x80 ? 1 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
    if ((lead >= 0x80 && lead < 0xc2) || lead > 0xf4 || i + length > text.size()) {
      return false;
    }
    for (std::size_t j = 1; j < length; ++j) {
      const auto byte = static_cast<unsigned char>(text[i + j]);
      // The second byte also keeps out overlong forms, surrogates and what lies above U+10FFFF.
      const unsigned low = j > 1 ? 0x80 : lead == 0xe0 ? 0xa0 : lead == 0xf0 ? 0x90 : 0x80;
      const unsigned high = j > 1 ? 0xbf : lead == 0xed ? 0x9f : lead == 0xf4 ? 0x8f : 0xbf;
      if (byte < low || byte > high) {
        return false;
      }
    }
    i += length;
  }
  return true;
}

std::string hexadecimal(std::string_view bytes) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string text = "x'";
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    text += kDigits[byte >> 4U];
    text += kDigits[byte & 0xfU];
  }
  return text + "'";
}

void set_value(sqlite3_stmt* statement, int column, protocol::Value& value) {
  switch (sqlite3_column_type(statement, column)) {
    case SQLITE_INTEGER:
      value.set_integer(sqlite3_column_int64(statement, column));
      break;
    case SQLITE_FLOAT:
      value.set_real(sqlite3_column_double(statement, column));
      break;
    case SQLITE_NULL:
      break;
    default: {
      const bool is_text = sqlite3_column_type(statement, column) == SQLITE_TEXT;
      const void* data = sqlite3_column_blob(statement, column);
      const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement, column));
      const std::string_view bytes(size == 0 ? "" : static_cast<const char*>(data), size);
      value.set_text(is_text && is_utf8(bytes) ? std::string(bytes) : hexadecimal(bytes));
    }
  }
}

bool is_blank(std::string_view text) {
  return text.find_first_not_of(" \t\r\n;") == std::string_view::npos;
}

using StatementHandle = std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)>;

StatementHandle prepare(sqlite3* database, const std::string& sql) {
  sqlite3_stmt* raw = nullptr;
  const char* tail = nullptr;
  const int code =
      sqlite3_prepare_v2(database, sql.c_str(), static_cast<int>(sql.size()) + 1, &raw, &tail);
  StatementHandle statement(raw, &sqlite3_finalize);
  if (code == SQLITE_AUTH) {
    throw QueryError(std::string("only statements that read are allowed: ") +
                     sqlite3_errmsg(database));
  }
  if (code != SQLITE_OK) {
    throw QueryError(std::string("the statement is wrong: ") + sqlite3_errmsg(database));
  }
  if (statement == nullptr) {
    throw QueryError("there is no statement");
  }
  if (!is_blank(tail)) {
    throw QueryError("one statement at a time: something follows the first");
  }
  if (sqlite3_stmt_readonly(raw) == 0) {
    throw QueryError("only statements that read are allowed");
  }
  return statement;
}

}  // namespace

struct Reader::Deadline {
  using Clock = std::chrono::steady_clock;

  /// Watches the queries of `database` until it is destroyed.
  Deadline(sqlite3* watched, const std::atomic<bool>& interrupt, std::int64_t limit_ms)
      : database(watched), interrupted(interrupt), time_limit_ms(limit_ms) {
    sqlite3_progress_handler(
        database, kInstructionsPerLook,
        [](void* self) { return static_cast<const Deadline*>(self)->is_over() ? 1 : 0; }, this);
  }
  ~Deadline() { sqlite3_progress_handler(database, 0, nullptr, nullptr); }
  Deadline(const Deadline&) = delete;
  Deadline& operator=(const Deadline&) = delete;

  bool is_over() const {
    return interrupted ||
           (time_limit_ms > 0 && Clock::now() - start > std::chrono::milliseconds(time_limit_ms));
  }

  sqlite3* database;
  const std::atomic<bool>& interrupted;
  std::int64_t time_limit_ms;
  Clock::time_point start = Clock::now();
};

Reader::Reader(const std::string& path) {
  check_path(path);
  if (!std::filesystem::exists(path)) {
    throw StorageError("there is no database " + path);
  }
  database_ = open_database(path, SQLITE_OPEN_READONLY);
  sqlite3_busy_timeout(database_.get(), kBusyTimeout_ms);
  if (identify(database_.get(), path) == DatabaseKind::kEmpty) {
    throw StorageError(path + " is empty: no study was ever stored in it");
  }
  sqlite3_limit(database_.get(), SQLITE_LIMIT_SQL_LENGTH, kLongestSql);
  sqlite3_db_config(database_.get(), SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_set_authorizer(database_.get(), &authorize, nullptr);
}

protocol::QueryReply Reader::query(const std::string& sql, const QueryLimits& limits) {
  if (sql.size() > kLongestSql) {
    throw QueryError("the statement is longer than " + std::to_string(kLongestSql) + " bytes");
  }
  const Deadline deadline(database_.get(), interrupted_, limits.time_limit_ms);
  const StatementHandle statement = prepare(database_.get(), sql);
  protocol::QueryReply reply;
  const int columns = sqlite3_column_count(statement.get());
  for (int i = 0; i < columns; ++i) {
    const std::string_view name = sqlite3_column_name(statement.get(), i);
    reply.add_columns(is_utf8(name) ? std::string(name) : hexadecimal(name));
  }
  std::uint64_t bytes = 0;
  int code = sqlite3_step(statement.get());
  for (; code == SQLITE_ROW; code = sqlite3_step(statement.get())) {
    protocol::Row row;
    for (int i = 0; i < columns; ++i) {
      set_value(statement.get(), i, *row.add_values());
    }
    bytes += row.ByteSizeLong() + 8;
    if (static_cast<std::uint64_t>(reply.rows_size()) >= limits.max_rows ||
        bytes > limits.max_bytes) {
      reply.set_truncated(true);
      return reply;
    }
    *reply.add_rows() = std::move(row);
  }
  if (code == SQLITE_INTERRUPT && !interrupted_) {
    throw QueryError("the query took longer than " + std::to_string(limits.time_limit_ms) + " ms");
  }
  if (code != SQLITE_DONE) {
    throw QueryError(std::string("the query failed: ") + sqlite3_errmsg(database_.get()));
  }
  return reply;
}

std::vector<protocol::StudyStatus> Reader::study_status(const std::string& name) {
  Statement schema(database_.get(), "PRAGMA user_version");
  constexpr int kFirstWithShares = 2;
  const bool has_shares = schema.step() && schema.integer(0) >= kFirstWithShares;
  // Counts come from the indices of `results`: its rows are not touched.
  Statement list(database_.get(),
                 "SELECT s.study_id, s.name, s.state, s.points, s.created_at,"
                 " (SELECT count(*) FROM results AS r WHERE r.study_id = s.study_id),"
                 " (SELECT count(*) FROM results AS r WHERE r.study_id = s.study_id"
                 " AND r.status = 'failed')" +
                     std::string(has_shares ? ", s.priority, s.weight" : ", 0, 1.0") +
                     " FROM studies AS s WHERE ?1 = '' OR s.name = ?1 ORDER BY s.study_id");
  list.bind(1, name);
  std::vector<protocol::StudyStatus> found;
  while (list.step()) {
    protocol::StudyStatus status;
    const std::int64_t settled = list.integer(5);
    status.set_study_id(static_cast<std::uint64_t>(list.integer(0)));
    status.set_name(list.text(1));
    // A server that was killed may not have noted the end of a study.
    status.set_state(settled == list.integer(3) ? "done" : list.text(2));
    status.set_points(static_cast<std::uint64_t>(list.integer(3)));
    status.set_created_at(list.text(4));
    status.set_failed(static_cast<std::uint64_t>(list.integer(6)));
    status.set_solved(static_cast<std::uint64_t>(settled) - status.failed());
    status.set_priority(static_cast<std::int32_t>(list.integer(7)));
    status.set_weight(list.real(8));
    found.push_back(std::move(status));
  }
  if (found.empty() && !name.empty()) {
    throw QueryError("there is no study called \"" + name + "\"");
  }
  return found;
}

}  // namespace oblique::server
