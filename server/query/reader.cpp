#include "server/query/reader.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "server/database/open_for_reading.h"
#include "server/query/plan.h"

namespace oblique::server {
namespace {

/// Adds from which studies the results of a study were copied.
void add_taken(Statement& origins, protocol::StudyStatus& status) {
  constexpr int kMostNamed = 20;
  origins.bind(1, status.study_id());
  while (origins.step()) {
    auto& taken = *status.mutable_taken();
    const auto points = static_cast<std::uint64_t>(origins.integer(1));
    taken.set_points(taken.points() + points);
    if (taken.from_size() < kMostNamed) {
      auto& from = *taken.add_from();
      from.set_study(origins.text(0));
      from.set_points(points);
    }
  }
  origins.reset();
}

std::int64_t steady_ms() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::milliseconds(1);
}

/// Copies a text or blob; bytes that are not UTF-8 as x'0F..'.
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

/// Steps to the next row. False after the last.
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
    // Each value is bounded by max_value_bytes.
    if (rows_->bytes() - before > limits_.max_row_bytes) {
      throw QueryError("one row alone has more than the " + std::to_string(limits_.max_row_bytes) +
                       " bytes of a reply, blobs counted twice: select less of it, as with "
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

Reader::Reader(const std::string& path) {
  auto opened = open_for_reading(path);
  database_ = std::move(opened.database);
  remark_ = std::move(opened.remark);
  constexpr int kBusyTimeout_ms = 2000;
  sqlite3_busy_timeout(database_.get(), kBusyTimeout_ms);
  if (identify(database_.get(), path) == DatabaseKind::kEmpty) {
    throw StorageError(path + " is empty: no study was ever stored in it");
  }
  restrict_to_reading(database_.get());
  constexpr int kInstructionsPerCheck = 10'000;  // of SQLite's virtual machine
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
  // Counts come from `completed_ranges` and indices where possible, so that rows need not be read.
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
    const std::int64_t settled = list.integer(5);
    status.set_study_id(static_cast<std::uint64_t>(list.integer(0)));
    status.set_name(list.text(1));
    // A server that was killed may not have stored that the study is done.
    status.set_state(settled == list.integer(3) ? "done" : list.text(2));
    status.set_points(static_cast<std::uint64_t>(list.integer(3)));
    status.set_created_at(list.text(4));
    status.set_failed(static_cast<std::uint64_t>(list.integer(6)));
    status.set_left_out(static_cast<std::uint64_t>(list.integer(10)));
    const std::uint64_t unsolved = status.failed() + status.left_out();
    const auto completed = static_cast<std::uint64_t>(settled);
    status.set_solved(completed - std::min(completed, unsolved));
    status.set_priority(static_cast<std::int32_t>(list.integer(7)));
    status.set_submitted_by(list.text(8));
    status.set_solver_version(list.text(9));
    add_taken(origins, status);
    found.push_back(std::move(status));
  }
  if (found.empty() && !name.empty()) {
    throw QueryError(no_such_study(database_.get(), name));
  }
  return found;
}

}  // namespace oblique::server
