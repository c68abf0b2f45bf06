#include "server/reading/answer.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "proto/text.h"
#include "server/asking/plan.h"
#include "server/reading/query_values.h"
#include "server/reading/running_time.h"

namespace oblique::server {
namespace {

using Clock = std::chrono::steady_clock;

/// Of an answer that can go on from a point. Planning it again takes some milliseconds.
constexpr std::chrono::seconds kLongestTransaction{2};

}  // namespace

Answer::Answer(sqlite3* database, protocol::QueryRequest request, const QueryLimits& limits,
               const std::atomic<bool>& interrupted)
    : database_(database),
      request_(std::move(request)),
      limits_(limits),
      interrupted_(interrupted) {
  sqlite3_limit(database_, SQLITE_LIMIT_LENGTH, static_cast<int>(limits_.max_value_bytes));
  const RunningTime watch(database_, interrupted_, limits_.time_limit_ms);
  begin();
}

std::string Answer::planned() {
  protocol::StudyQuery question = request_.question();
  const protocol::GivenRows& given = request_.after();
  if (given.rows() > 0) {
    question.set_after_point(static_cast<std::uint64_t>(given.last_point()));
    if (question.has_limit()) {
      question.set_limit(question.limit() - std::min(question.limit(), given.rows()));
    }
  }
  Plan found = plan(database_, question);
  by_point_ = found.goes_on_by_point;
  units_.clear();
  for (PlannedColumn& column : found.columns) {
    units_.push_back(std::move(column.unit));
  }
  return std::move(found.statement);
}

void Answer::begin() {
  let_like_tell_capitals_apart(database_, request_.has_question());
  statement_ = prepare_query(database_, request_.has_question() ? planned() : request_.sql());
  begun_ = Clock::now();
  columns_ = sqlite3_column_count(statement_.get()) - (by_point_ ? 1 : 0);
  if (rows_) {
    return;
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
  // What can go on harms nobody by being long; of any other the whole time counts in the end.
  if (!by_point_ && limits_.longest_in_all_ms > 0 && running_ms_ > limits_.longest_in_all_ms) {
    throw QueryError(took_too_long(limits_.longest_in_all_ms));
  }
  const RunningTime watch(database_, interrupted_, limits_.time_limit_ms);
  if (statement_ == nullptr && !by_point_) {
    throw QueryError(
        "the answer was ended in the middle: nothing of it was taken for long, and "
        "the database could not empty its log meanwhile. Write it to a file first, or "
        "ask in the order of points, which can wait");
  }
  if (statement_ == nullptr) {
    begin();
  }
  bool ends = true;
  while (step()) {
    copy_row();
    if (by_point_) {
      request_.mutable_after()->set_last_point(sqlite3_column_int64(statement_.get(), columns_));
    }
    if (rows_->bytes() >= kChunkBytes || watch.elapsed_ms() >= kLongestChunk_ms) {
      ends = false;
      break;
    }
  }
  running_ms_ += watch.elapsed_ms();
  auto& given = *request_.mutable_after();
  given.set_chunks(given.chunks() + 1);
  given.set_rows(given.rows() + rows_->rows());
  protocol::QueryReply chunk = rows_->take();
  chunk.set_chunk(given.chunks());
  chunk.set_ends(ends);
  *chunk.mutable_units() = {units_.begin(), units_.end()};
  if (ends || (by_point_ && Clock::now() - begun_ >= kLongestTransaction)) {
    statement_.reset();
  }
  return chunk;
}

void Answer::rest() {
  statement_.reset();
}

bool Answer::step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) {
    return true;
  }
  if (code == SQLITE_INTERRUPT) {
    throw QueryError(interrupted_ ? "the query was interrupted"
                                  : took_too_long(limits_.time_limit_ms));
  }
  if (code != SQLITE_DONE) {
    throw_failure(database_, code);
  }
  return false;
}

void Answer::copy_row() {
  const std::uint64_t before = rows_->bytes();
  for (int i = 0; i < columns_; ++i) {
    const std::uint64_t left =
        limits_.max_bytes - std::min(limits_.max_bytes, rows_->bytes() - before);
    const Copied copied = copy_value(statement_.get(), i, left, *rows_);
    if (copied == Copied::kNoMemory) {
      throw failure(database_, SQLITE_NOMEM);
    }
    if (copied == Copied::kTooLarge) {
      throw QueryError("one row alone has more than the " + std::to_string(limits_.max_bytes) +
                       " bytes of a reply, blobs counted twice: select less of it, as with "
                       "substr() or length()");
    }
  }
  rows_->end_row();
}

}  // namespace oblique::server
