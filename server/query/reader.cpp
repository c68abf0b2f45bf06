#include "server/query/reader.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "proto/suggestion.h"
#include "proto/text.h"
#include "server/database/open_for_reading.h"
#include "server/query/plan.h"

namespace oblique::server {
namespace {

constexpr int kBusyTimeout_ms = 2000;
/// Selects the solver version of a study's results, which all have the same one.
constexpr const char* kVersionOfRows =
    "SELECT w.solver_version FROM results AS r CROSS JOIN workers AS w"
    " ON w.worker_id = r.worker_id WHERE r.study_id = s.study_id ORDER BY r.point LIMIT 1";
/// Selects how many results a study has copied from each source.
constexpr const char* kSources =
    "SELECT source, points FROM reused_points WHERE study_id = ? ORDER BY points DESC";

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

/// Interrupts the statement of `database` that runs longer than `limit_ms` (0: no limit), or when
/// `interrupted` is set, while this exists. SQLite returns SQLITE_INTERRUPT then.
class TimeLimit {
 public:
  TimeLimit(sqlite3* database, const std::atomic<bool>& interrupted, std::int64_t limit_ms)
      : database_(database), interrupted_(interrupted), limit_ms_(limit_ms) {
    constexpr int kInstructionsPerCheck = 10'000;  // of SQLite's virtual machine
    sqlite3_progress_handler(
        database_, kInstructionsPerCheck,
        [](void* self) { return static_cast<const TimeLimit*>(self)->is_over() ? 1 : 0; }, this);
  }
  ~TimeLimit() { sqlite3_progress_handler(database_, 0, nullptr, nullptr); }
  TimeLimit(const TimeLimit&) = delete;
  TimeLimit& operator=(const TimeLimit&) = delete;

  std::int64_t elapsed_ms() const {
    return std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - start_).count();
  }

 private:
  using Clock = std::chrono::steady_clock;

  bool is_over() const { return interrupted_ || (limit_ms_ > 0 && elapsed_ms() > limit_ms_); }

  sqlite3* database_;
  const std::atomic<bool>& interrupted_;
  std::int64_t limit_ms_;
  Clock::time_point start_ = Clock::now();
};

/// Length of `size` bytes as x'0F..'.
std::uint64_t hexadecimal_bytes(std::uint64_t size) {
  return 2 * size + 3;
}

/// Copies a text or blob. False when it is longer than `most_bytes`; nothing is copied then.
bool copy_bytes(sqlite3* database, sqlite3_stmt* statement, int column, std::uint64_t most_bytes,
                protocol::ChunkWriter& rows) {
  const bool is_text = sqlite3_column_type(statement, column) == SQLITE_TEXT;
  // The size of a zeroblob is known before its bytes are allocated.
  const auto size = static_cast<std::uint64_t>(sqlite3_column_bytes(statement, column));
  if ((is_text ? size : hexadecimal_bytes(size)) > most_bytes) {
    return false;
  }
  const void* data = sqlite3_column_blob(statement, column);
  if (data == nullptr && size > 0) {
    throw failure(database, SQLITE_NOMEM);
  }
  const std::string_view bytes(size == 0 ? "" : static_cast<const char*>(data), size);
  if (is_text && protocol::is_utf8(bytes)) {
    rows.text(bytes);
    return true;
  }
  if (hexadecimal_bytes(size) > most_bytes) {
    return false;
  }
  rows.text(hexadecimal(bytes));
  return true;
}

}  // namespace

Answer::Answer(sqlite3* database, const protocol::QueryRequest& request, const QueryLimits& limits,
               const std::atomic<bool>& interrupted)
    : database_(database), limits_(limits), interrupted_(interrupted) {
  sqlite3_limit(database_, SQLITE_LIMIT_LENGTH, static_cast<int>(limits_.max_value_bytes));
  const TimeLimit time(database_, interrupted_, limits_.time_limit_ms);
  std::string sql = request.sql();
  if (request.has_question()) {
    Plan planned = plan(database_, request.question());
    sql = std::move(planned.statement);
    for (PlannedColumn& column : planned.columns) {
      units_.push_back(std::move(column.unit));
    }
  }
  statement_ = prepare_query(database_, sql);
  std::vector<std::string> names;
  for (int i = 0; i < sqlite3_column_count(statement_.get()); ++i) {
    const char* name = sqlite3_column_name(statement_.get(), i);
    if (name == nullptr) {
      throw failure(database_, SQLITE_NOMEM);
    }
    names.push_back(protocol::is_utf8(name) ? std::string(name) : hexadecimal(name));
  }
  rows_.emplace(std::move(names));
}

protocol::QueryReply Answer::next() {
  const TimeLimit time(database_, interrupted_, limits_.time_limit_ms);
  bool ends = true;
  while (step()) {
    copy_row();
    if (rows_->bytes() >= kChunkBytes || time.elapsed_ms() >= limits_.longest_chunk_ms) {
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
    throw QueryError(interrupted_ ? "the query was interrupted"
                                  : took_too_long(limits_.time_limit_ms));
  }
  if (code != SQLITE_ROW && code != SQLITE_DONE) {
    throw_failure(database_, code);
  }
  return code == SQLITE_ROW;
}

void Answer::copy_row() {
  const std::uint64_t before = rows_->bytes();
  for (int i = 0; i < sqlite3_column_count(statement_.get()); ++i) {
    const std::uint64_t used = rows_->bytes() - before;
    const std::uint64_t left = limits_.max_row_bytes - std::min(limits_.max_row_bytes, used);
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
        if (!copy_bytes(database_, statement_.get(), i, left, *rows_)) {
          throw QueryError("one row alone has more than the " +
                           std::to_string(limits_.max_row_bytes) +
                           " bytes of a reply, blobs counted twice: select less of it, as with "
                           "substr() or length()");
        }
    }
  }
  rows_->end_row();
}

std::string hexadecimal(std::string_view bytes) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string text = "x'";
  text.reserve(hexadecimal_bytes(bytes.size()));
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    text += kDigits[byte >> 4U];
    text += kDigits[byte & 0xfU];
  }
  return text += '\'';
}

Reader::Reader(const std::string& path) {
  auto opened = open_for_reading(path);
  database_ = std::move(opened.database);
  remark_ = std::move(opened.remark);
  sqlite3_busy_timeout(database_.get(), kBusyTimeout_ms);
  if (identify(database_.get(), path) == DatabaseKind::kEmpty) {
    throw StorageError(path + " is empty: no study was ever stored in it");
  }
  restrict_to_reading(database_.get());
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
  return {database_.get(), request, limits, interrupted_};
}

/// " (did you mean `x`?)" with the study whose name is nearest, or an empty text.
std::string Reader::nearest_study(const std::string& name) {
  constexpr std::size_t kMostCompared = 10'000;
  Statement list(database_.get(), "SELECT name FROM studies");
  std::vector<std::string> names;
  while (names.size() < kMostCompared && list.step()) {
    names.push_back(list.text(0));
  }
  return protocol::did_you_mean(name, std::vector<std::string_view>(names.begin(), names.end()));
}

std::vector<protocol::StudyStatus> Reader::study_status(const std::string& name) {
  // Counts come from `completed_ranges` and indices where possible, so that rows need not be read.
  Statement list(
      database_.get(),
      std::string("SELECT s.study_id, s.name, s.state, s.points, s.created_at,"
                  " CASE s.counted WHEN 1 THEN (SELECT coalesce(sum(c.points), 0) FROM"
                  " completed_ranges AS c WHERE c.study_id = s.study_id) ELSE"
                  " (SELECT count(*) FROM results AS r WHERE r.study_id = s.study_id) END,"
                  " (SELECT count(*) FROM results AS r INDEXED BY failed_points"
                  " WHERE r.study_id = s.study_id AND r.error IS NOT NULL),"
                  " s.priority, coalesce(s.submitted_by, ''),"
                  " coalesce((") +
          kVersionOfRows +
          "), ''), CASE s.counted WHEN 1 THEN s.left_out ELSE 0 END FROM studies AS s"
          " WHERE ?1 = '' OR s.name = ?1 ORDER BY s.study_id");
  list.bind(1, name);
  Statement origins(database_.get(), kSources);
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
    throw QueryError("there is no study called \"" + name + "\"" + nearest_study(name));
  }
  return found;
}

}  // namespace oblique::server
