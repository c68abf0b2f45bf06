#include "server/query_thread.h"

#include <algorithm>
#include <utility>

namespace oblique::server {
namespace {

constexpr std::size_t kMostWaiting = 64;

}  // namespace

QueryThread::QueryThread(const std::string& path, Report report)
    : reader_(path), report_(std::move(report)), thread_([this] { run(); }) {}

QueryThread::~QueryThread() {
  reader_.interrupt();
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    wake_.notify_one();
  }
  thread_.join();
}

bool QueryThread::submit(QueryJob job) {
  const std::lock_guard lock(mutex_);
  if (queue_.size() >= kMostWaiting) {
    return false;
  }
  queue_.push_back(std::move(job));
  wake_.notify_one();
  return true;
}

void QueryThread::run() {
  while (true) {
    QueryJob job;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] { return stopping_ || !queue_.empty(); });
      if (stopping_) {
        return;
      }
      job = std::move(queue_.front());
      queue_.pop_front();
    }
    report_(answer(job));
  }
}

QueryReport QueryThread::answer(const QueryJob& job) {
  QueryReport report{job.ticket, {}, {}};
  QueryLimits limits;
  if (job.request.max_rows() > 0) {
    limits.max_rows = std::min(limits.max_rows, job.request.max_rows());
  }
  try {
    report.reply = reader_.query(job.request.sql(), limits);
  } catch (const QueryError& error) {
    report.error = error.what();
  }
  return report;
}

}  // namespace oblique::server
