// Answers in chunks.
#include <algorithm>
#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/service/connection.h"
#include "proto/frames.h"
#include "proto/wire/chunk.h"
#include "worker/solver/model/number.h"

namespace oblique::client {

void Connection::ask_for_rows(protocol::QueryRequest request) {
  end_rows();
  Rows rows;
  *rows.request.mutable_query() = std::move(request);
  rows.request.mutable_query()->set_time_limit_ms(static_cast<std::uint64_t>(settings_.timeout_ms));
  rows_ = std::move(rows);
}

std::vector<protocol::QueryReply> Connection::chunks(protocol::QueryRequest request,
                                                     const Tell& tell) {
  ask_for_rows(std::move(request));
  rows_->tell = tell;
  std::vector<protocol::QueryReply> all;
  while (rows_) {
    all.push_back(next_rows());
  }
  return all;
}

protocol::Table Connection::query(const std::string& sql, const Tell& tell) {
  protocol::QueryRequest request;
  request.set_sql(sql);
  protocol::Table whole;
  for (const protocol::QueryReply& chunk : chunks(std::move(request), tell)) {
    protocol::append_rows(chunk, whole);
  }
  return whole;
}

protocol::QueryReply Connection::next_rows() {
  protocol::QueryReply chunk;
  if (rows_->chunks > 0) {
    chunk = more_rows();
  } else {
    // A call ends what is under way.
    Rows rows = *std::exchange(rows_, std::nullopt);
    chunk = std::move(*call_numbered(rows.request, rows.tell).mutable_query());
    rows.connection = monitor_.connections();
    rows_ = std::move(rows);
  }
  std::vector<std::string> columns(chunk.columns().begin(), chunk.columns().end());
  if (rows_->chunks == 0) {
    rows_->columns = columns;
  }
  if (chunk.chunk() != rows_->chunks + 1 || !protocol::is_sound(chunk) ||
      columns != rows_->columns) {
    broke_off(fmt::format("what came from {} is not its next part", settings_.server_url));
  }
  ++rows_->chunks;
  rows_->rows += chunk.chunk_rows();
  if (chunk.ends()) {
    rows_.reset();
  }
  return chunk;
}

protocol::QueryReply Connection::more_rows() {
  protocol::ClientRequest wish;
  wish.mutable_more_rows()->set_request_id(rows_->request.request_id());
  wish.mutable_more_rows()->set_taken(rows_->chunks);
  tell_of_rows(wish);
  // Time in which this process did not run, or its machine slept, is not waited.
  constexpr std::chrono::milliseconds kLongestSlice{500};
  const std::chrono::milliseconds timeout(settings_.timeout_ms);
  Clock::duration waited{0};
  while (waited < timeout) {
    const auto before = Clock::now();
    if (auto reply = received(rows_->request.request_id()); reply && !reply->has_still_working()) {
      check(*reply, rows_->request);
      return std::move(*reply->mutable_query());
    }
    if (monitor_.connections() != rows_->connection) {
      broke_off(fmt::format("the connection to {} was lost", settings_.server_url));
    }
    wait_a_slice(false);
    waited += std::min<Clock::duration>(Clock::now() - before, kLongestSlice);
  }
  broke_off(fmt::format("nothing came from {} for {} s", settings_.server_url,
                        solver::exact_number(static_cast<double>(settings_.timeout_ms) / 1000.0)));
}

void Connection::tell_of_rows(const protocol::ClientRequest& wish) {
  protocol::ClientRequest request = wish;
  request.set_protocol_version(protocol::kProtocolVersion);
  // Without a reply it needs no number of its own; errors come under that of the query.
  request.set_request_id(rows_->request.request_id());
  // What cannot be sent is not missed: nothing more comes then, which is noticed.
  (void)socket_.send(zmq::buffer(protocol::encode(request)), zmq::send_flags::dontwait);
}

void Connection::end_rows() {
  if (rows_ && rows_->chunks > 0) {
    protocol::ClientRequest wish;
    wish.mutable_end_query()->set_request_id(rows_->request.request_id());
    tell_of_rows(wish);
  }
  rows_.reset();
}

void Connection::broke_off(const std::string& why) const {
  throw ConnectionError(
      fmt::format("the answer broke off after {} rows: {}. Ask again", rows_->rows, why));
}

}  // namespace oblique::client
