#include "server/service/outbox/request_reader.h"

#include <exception>
#include <memory>
#include <utility>

#include "proto/frame_scan.h"
#include "proto/frames.h"
#include "proto/recipe/checks.h"
#include "proto/recipe/model_message.h"

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

ReadRequest read_request(std::string_view frame) {
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
    protocol::check_size(read.request.submit().recipe());
    read.table = std::make_shared<const protocol::PointTable>(
        std::move(*read.request.mutable_submit()->mutable_recipe()));
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
    wake_.notify_one();
  }
  thread_.join();
}

void RequestReader::submit(ReadJob job) {
  const std::lock_guard lock(mutex_);
  queue_.push_back(std::move(job));
  wake_.notify_one();
}

void RequestReader::run() {
  while (true) {
    ReadJob job;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] { return stopping_ || !queue_.empty(); });
      if (stopping_) {
        return;
      }
      job = std::move(queue_.front());
      queue_.pop_front();
    }
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
    report_(std::move(report));
  }
}

}  // namespace oblique::server
