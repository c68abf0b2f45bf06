#include "server/reading/answer.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "proto/text.h"
#include "server/asking/plan.h"

namespace oblique::server {
namespace {

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
  if (request.has_question()) {
    Plan planned = plan(database_, request.question());
    statement_ = prepare_query(database_, planned.statement);
    // The statement may have further columns.
    columns_ = static_cast<int>(planned.columns.size());
    for (PlannedColumn& column : planned.columns) {
      units_.push_back(std::move(column.unit));
    }
  } else {
    statement_ = prepare_query(database_, request.sql());
    columns_ = sqlite3_column_count(statement_.get());
  }
  std::vector<std::string> names;
  for (int i = 0; i < columns_; ++i) {
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
    if (rows_->bytes() >= kChunkBytes || time.elapsed_ms() >= kLongestChunk_ms) {
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
  for (int i = 0; i < columns_; ++i) {
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

}  // namespace oblique::server
