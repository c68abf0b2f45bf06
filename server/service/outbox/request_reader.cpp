#include "server/service/outbox/request_reader.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <memory>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "proto/recipe/checks.h"
#include "proto/recipe/model_message.h"
#include "proto/wire/frame_scan.h"

namespace oblique::server {
namespace {

TracedPoint read_point(const std::string& recipe_bytes, std::uint64_t point) {
  TracedPoint traced;
  protocol::Recipe recipe;
  if (!recipe.ParseFromString(recipe_bytes)) {
    traced.objection = "the bytes of its study are damaged";
    return traced;
  }
  try {
    return traced_point(protocol::PointTable(std::move(recipe)), point);
  } catch (const std::exception& error) {
    traced.objection = error.what();
    return traced;
  }
}

}  // namespace

TracedPoint traced_point(const protocol::PointTable& table, std::uint64_t point) {
  TracedPoint objected;
  if (point >= table.size()) {
    objected.objection =
        fmt::format("the study has no point {}: its points are 0 to {}", point, table.size() - 1);
    return objected;
  }
  objected.objection = table.is_left_in(point)
                           ? table.fault(point)
                           : fmt::format("point {} is left out by the study's filter", point);
  if (!objected.objection.empty()) {
    return objected;
  }
  const protocol::Point values = table.point(point);
  return {protocol::to_message(table.model(values.model)),
          values.H_m,
          values.mu,
          values.e_star,
          table.wants_errors(),
          {}};
}

protocol::TraceReply said_of(const TracedPoint& point) {
  protocol::TraceReply reply;
  *reply.mutable_model() = point.model;
  reply.set_h_m(point.H_m);
  reply.set_mu(point.mu);
  reply.set_e_star(point.e_star);
  reply.set_errors(point.errors);
  return reply;
}

ReadRequest read_request(std::string_view frame, bool judges) {
  // Padding cannot make much of a shorter frame.
  constexpr std::size_t kLookedAtAbove = std::size_t{64} * 1024;
  ReadRequest read;
  read.is_readable = (frame.size() <= kLookedAtAbove || protocol::is_of_a_requests_shape(frame)) &&
                     protocol::decode(frame, read.request);
  read.request_id = read.is_readable ? read.request.request_id() : protocol::request_id_of(frame);
  if (!read.is_readable || !read.request.has_submit()) {
    return read;
  }
  try {
    protocol::Recipe& recipe = *read.request.mutable_submit()->mutable_recipe();
    protocol::check_size(recipe);
    auto table = std::make_shared<const protocol::PointTable>(std::move(recipe));
    read.needs_judging = table->needs_judging() && !judges;
    if (judges) {
      table->judge_points();
    }
    read.table = std::move(table);
  } catch (const solver::InputError& error) {
    read.objection = error.what();
  }
  read.request.mutable_submit()->clear_recipe();
  return read;
}

RequestReader::RequestReader(Report report)
    : report_(std::move(report)), thread_([this] { run(); }) {}

RequestReader::~RequestReader() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    wake_.notify_all();
  }
  thread_.join();
}

void RequestReader::submit(ReadJob job) {
  const std::lock_guard lock(mutex_);
  waiting_.push_back(std::move(job));
  wake_.notify_all();
}

void RequestReader::cancel(std::uint64_t ticket) {
  const std::lock_guard lock(mutex_);
  std::erase_if(waiting_, [&](const ReadJob& job) { return job.ticket == ticket; });
}

/// The one whose turn it is.
ReadJob RequestReader::next() {
  std::erase_if(spent_, [&](const auto& entry) {
    return std::none_of(waiting_.begin(), waiting_.end(),
                        [&](const ReadJob& job) { return job.client == entry.first; });
  });
  auto first = waiting_.begin();
  if (++turns_ % 2 == 1) {
    const auto rank = [&](const ReadJob& job) {
      return std::pair(spent_[job.client],
                       job.of_study ? job.of_study->recipe_bytes().size() : job.frame.size());
    };
    first = std::min_element(waiting_.begin(), waiting_.end(),
                             [&](const ReadJob& a, const ReadJob& b) { return rank(a) < rank(b); });
  }
  ReadJob job = std::move(*first);
  waiting_.erase(first);
  return job;
}

ReadReport RequestReader::read(const ReadJob& job) {
  ReadReport report{job.ticket, {}};
  try {
    if (job.of_study) {
      report.point = read_point(job.of_study->recipe_bytes(), job.point);
    } else {
      report.read = read_request(job.frame);
    }
  } catch (const std::exception&) {  // there is no memory for it
    if (job.of_study) {
      report.point.emplace().objection = "there is no memory to read its study";
    }
    report.read.request_id = protocol::request_id_of(job.frame);
  }
  return report;
}

void RequestReader::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [&] { return stopping_ || !waiting_.empty(); });
    if (stopping_) {
      return;
    }
    const ReadJob job = next();
    const Clock::duration spent = spent_[job.client];
    lock.unlock();
    const auto began = Clock::now();
    report_(read(job));
    lock.lock();
    spent_[job.client] = spent + (Clock::now() - began);
  }
}

}  // namespace oblique::server
