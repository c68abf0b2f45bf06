#include "server/query/reader.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <iterator>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "server/query/plan.h"
#include "server/query/sql_text.h"
#include "server/store/schema.h"

namespace oblique::server {
namespace {

constexpr const char* kOnlyReads = "only reading is allowed";

/// Returns false for functions that reach outside the database, use addresses of this process, run
/// SQL, or belong to virtual tables that our databases do not have.
bool is_harmless_function(std::string_view name) {
  constexpr std::array<std::string_view, 16> kOthers{
      "load_extension", "fts3_tokenizer", "fts5",       "fts5_source_id",
      "bm25",           "highlight",      "match",      "matchinfo",
      "offsets",        "optimize",       "rtreecheck", "rtreedepth",
      "rtreenode",      "snippet",        "sqlite_log", "edit"};
  return std::ranges::find(kOthers, name) == kOthers.end();
}

/// SQLite's authorizer, which also applies inside views: allows only reading and computing.
int authorize(void*, int action, const char*, const char* function, const char*, const char*) {
  switch (action) {
    case SQLITE_SELECT:
    case SQLITE_READ:
    case SQLITE_RECURSIVE:
      return SQLITE_OK;
    case SQLITE_FUNCTION:
      return function != nullptr && is_harmless_function(function) ? SQLITE_OK : SQLITE_DENY;
    default:
      return SQLITE_DENY;
  }
}

void add_origins(Statement& origins, protocol::StudyStatus& status) {
  constexpr int kMaxNamed = 20;
  origins.bind(1, status.study_id());
  while (origins.step()) {
    auto& taken = *status.mutable_reused();
    taken.set_points(taken.points() + origins.number(1));
    if (taken.from_size() < kMaxNamed) {
      auto& from = *taken.add_from();
      from.set_study(origins.text(0));
      from.set_points(origins.number(1));
    }
  }
  origins.reset();
}

std::int64_t steady_ms() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::milliseconds(1);
}

/// Copies a text or blob; writes bytes that are not UTF-8 as x'0F..'.
void copy_bytes(sqlite3* database, sqlite3_stmt* statement, int column,
                protocol::ChunkWriter& rows) {
  const bool is_text = sqlite3_column_type(statement, column) == SQLITE_TEXT;
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement, column));
  const void* data = sqlite3_column_blob(statement, column);
  if (data == nullptr && size > 0) {
    throw failure(database, SQLITE_NOMEM);
  }
  const std::string_view bytes(size == 0 ? "" : static_cast<const char*>(data), size);
  if (is_text && protocol::is_utf8(bytes)) {
    rows.text(bytes);
  } else {
    rows.text(hexadecimal(bytes));
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
      "the query took more than {} s: select less, for example with WHERE or LIMIT, or give it "
      "more time with --timeout",
      static_cast<double>(time_limit_ms) / 1000.0);
}

void restrict_to_reading(sqlite3* database) {
  execute(database, "PRAGMA temp_store = MEMORY; PRAGMA case_sensitive_like = ON");
  // SQLITE_DBCONFIG_TRUSTED_SCHEMA stays on; else SQLite 3.40 refuses json_extract in our views.
  constexpr std::array<std::pair<int, int>, 5> kSwitches{
      {{SQLITE_DBCONFIG_DEFENSIVE, 1},
       {SQLITE_DBCONFIG_DQS_DML, 0},
       {SQLITE_DBCONFIG_ENABLE_FTS3_TOKENIZER, 0},
       {SQLITE_DBCONFIG_ENABLE_LOAD_EXTENSION, 0},
       {SQLITE_DBCONFIG_ENABLE_TRIGGER, 0}}};
  for (const auto& [name, value] : kSwitches) {
    sqlite3_db_config(database, name, value, nullptr);
  }
  // SQLite creates these virtual tables at their first use, which the authorizer would refuse
  // later. So they are used here once.
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
  if (primary == SQLITE_AUTH || reason.starts_with("cannot modify ")) {
    throw StatementError(fmt::format("{}: {}", kOnlyReads, reason));
  }
  if (primary == SQLITE_ERROR) {
    throw StatementError(reason);
  }
  if (primary != SQLITE_OK) {
    throw failure(database, code);
  }
  if (statement == nullptr) {
    throw StatementError("the statement is empty");
  }
  if (std::string_view(tail).find_first_not_of(" \t\r\n;") != std::string_view::npos) {
    throw StatementError("only one statement is allowed, but more text follows it");
  }
  if (sqlite3_stmt_readonly(raw) == 0) {
    throw StatementError(kOnlyReads);
  }
  if (sqlite3_bind_parameter_count(raw) > 0) {
    throw StatementError(
        "the statement has a parameter (?, :x, @x or $x): write the value "
        "itself, texts in single quotes");
  }
  return statement;
}

QueryError failure(sqlite3* database, int code) {
  switch (static_cast<unsigned>(code) & 0xffU) {
    case SQLITE_NOMEM: {
      const std::int64_t limit = sqlite3_hard_heap_limit64(-1);
      return QueryError("the query needs more memory than " +
                        (limit > 0 ? fmt::format("the {} MiB allowed", limit >> 20U) : "there is") +
                        ": sort or group less, for example with WHERE or LIMIT");
    }
    case SQLITE_TOOBIG:
      return QueryError(fmt::format("a text, blob or row of the query exceeds the allowed {} MiB",
                                    sqlite3_limit(database, SQLITE_LIMIT_LENGTH, -1) >> 20));
    default:
      return QueryError(std::string("the query failed: ") + sqlite3_errmsg(database) +
                        (is_damage(code) ? kWayOut : ""));
  }
}

// ---- Answers ------------------------------------------------------------------------------------

Answer::Answer(sqlite3* database, const protocol::QueryRequest& request, const QueryLimits& limits,
               TimeLimit& time)
    : database_(database), limits_(limits), time_(time) {
  sqlite3_limit(database_, SQLITE_LIMIT_LENGTH, static_cast<int>(limits_.max_value_bytes));
  start_time();
  std::vector<std::string> names;
  if (request.has_question()) {
    Plan planned = plan(database_, request.question());
    statement_ = std::move(planned.statement);
    for (PlannedColumn& column : planned.columns) {
      names.push_back(std::move(column.name));
      units_.push_back(std::move(column.unit));
    }
  } else {
    statement_ = prepare_query(database_, request.sql());
    for (int i = 0; i < sqlite3_column_count(statement_.get()); ++i) {
      const char* name = sqlite3_column_name(statement_.get(), i);
      names.emplace_back(name == nullptr ? "" : name);
    }
  }
  for (std::string& name : names) {
    name = protocol::is_utf8(name) ? name : hexadecimal(name);
  }
  rows_.emplace(std::move(names));
}

void Answer::start_time() {
  start_ms_ = steady_ms();
  time_.end_ms = limits_.time_limit_ms > 0 ? start_ms_ + limits_.time_limit_ms : INT64_MAX;
}

protocol::QueryReply Answer::next() {
  start_time();
  bool ends = true;
  while (step()) {
    copy_row();
    if (rows_->bytes() >= kChunkBytes || steady_ms() - start_ms_ >= limits_.longest_chunk_ms) {
      ends = false;
      break;
    }
  }
  if (ends) {
    statement_.reset();
  }
  protocol::QueryReply chunk = rows_->take();
  chunk.set_chunk(++chunks_);
  chunk.set_ends(ends);
  *chunk.mutable_units() = {units_.begin(), units_.end()};
  return chunk;
}

bool Answer::step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_INTERRUPT) {
    throw QueryError(time_.is_interrupted ? "the query was interrupted"
                                          : took_too_long(limits_.time_limit_ms));
  }
  if (code != SQLITE_ROW && code != SQLITE_DONE) {
    throw failure(database_, code);
  }
  return code == SQLITE_ROW;
}

void Answer::copy_row() {
  const std::uint64_t before = rows_->bytes();
  for (int i = 0; i < sqlite3_column_count(statement_.get()); ++i) {
    switch (sqlite3_column_type(statement_.get(), i)) {
      case SQLITE_INTEGER:
        rows_->integer(sqlite3_column_int64(statement_.get(), i));
        break;
      case SQLITE_FLOAT:
        rows_->real(sqlite3_column_double(statement_.get(), i));
        break;
      case SQLITE_NULL:
        rows_->null();
        break;
      default:
        copy_bytes(database_, statement_.get(), i, *rows_);
    }
    if (rows_->bytes() - before > limits_.max_row_bytes) {
      throw QueryError("one row has more than the " + std::to_string(limits_.max_row_bytes) +
                       " bytes of a reply, blobs counted twice: select less, for example with "
                       "substr() or length()");
    }
  }
  rows_->end_row();
}

std::string hexadecimal(std::string_view bytes) {
  std::string text = "x'";
  for (const char c : bytes) {
    fmt::format_to(std::back_inserter(text), "{:02X}", static_cast<unsigned char>(c));
  }
  return text += '\'';
}

Reader::Reader(const std::string& path) : database_(open_with_schema(path)) {
  restrict_to_reading(database_.get());
  constexpr int kInstructionsPerCheck = 10'000;  // instructions of SQLite's virtual machine
  const auto is_over = [](void* time) {
    const auto* limit = static_cast<const TimeLimit*>(time);
    return limit->is_interrupted || steady_ms() > limit->end_ms ? 1 : 0;
  };
  sqlite3_progress_handler(database_.get(), kInstructionsPerCheck, is_over, &time_);
}

protocol::Table Reader::query(const std::string& sql, const QueryLimits& limits) {
  protocol::QueryRequest request;
  request.set_sql(sql);
  Answer rows = answer(request, limits);
  protocol::Table whole;
  for (bool ends = false; !ends;) {
    const protocol::QueryReply chunk = rows.next();
    protocol::append_rows(chunk, whole);
    ends = chunk.ends();
  }
  return whole;
}

Answer Reader::answer(const protocol::QueryRequest& request, const QueryLimits& limits) {
  return {database_.get(), request, limits, time_};
}

std::vector<protocol::StudyStatus> Reader::study_status(const std::string& name) {
  time_.end_ms = INT64_MAX;
  // Counts come from `completed_ranges` and indices where possible, because reading many rows is
  // slow.
  Statement list(database_.get(),
                 "SELECT s.study_id, s.name, s.state, s.points, s.created_at,"
                 " CASE s.counted WHEN 1 THEN (SELECT coalesce(sum(c.points), 0) FROM"
                 " completed_ranges AS c WHERE c.study_id = s.study_id) ELSE"
                 " (SELECT count(*) FROM results AS r WHERE r.study_id = s.study_id) END,"
                 " (SELECT count(*) FROM results AS r INDEXED BY failed_points"
                 " WHERE r.study_id = s.study_id AND r.error IS NOT NULL),"
                 " s.priority, coalesce(s.submitted_by, ''),"
                 // All results of a study have one solver version.
                 " coalesce((SELECT w.solver_version FROM results AS r CROSS JOIN workers AS w"
                 " ON w.worker_id = r.worker_id WHERE r.study_id = s.study_id"
                 " ORDER BY r.point LIMIT 1), ''),"
                 " CASE s.counted WHEN 1 THEN s.left_out ELSE 0 END FROM studies AS s"
                 " WHERE ?1 = '' OR s.name = ?1 ORDER BY s.study_id");
  list.bind(1, name);
  Statement origins(
      database_.get(),
      "SELECT source, points FROM reused_points WHERE study_id = ? ORDER BY points DESC");
  std::vector<protocol::StudyStatus> found;
  while (list.step()) {
    protocol::StudyStatus status;
    const std::uint64_t completed = list.number(5);
    status.set_study_id(list.number(0));
    status.set_name(list.text(1));
    // A killed server may not have stored the state "done".
    status.set_state(completed == list.number(3) ? "done" : list.text(2));
    status.set_points(list.number(3));
    status.set_created_at(list.text(4));
    status.set_failed(list.number(6));
    status.set_left_out(list.number(10));
    status.set_solved(completed - std::min(completed, status.failed() + status.left_out()));
    status.set_priority(static_cast<std::int32_t>(list.integer(7)));
    status.set_submitted_by(list.text(8));
    status.set_solver_version(list.text(9));
    add_origins(origins, status);
    found.push_back(std::move(status));
  }
  if (found.empty() && !name.empty()) {
    throw NoSuchStudy(no_such_study(database_.get(), name));
  }
  return found;
}

}  // namespace oblique::server
