#include "server/service/request_reader.h"

#include <exception>
#include <memory>
#include <utility>

#include "proto/frame_scan.h"
#include "proto/frames.h"
#include "proto/recipe/checks.h"

namespace oblique::server {
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
      report.read = read_request(job.frame);
    } catch (const std::exception&) {  // there is no memory for it
      report.read.request_id = protocol::request_id_of(job.frame);
    }
    report_(std::move(report));
  }
}

}  // namespace oblique::server
