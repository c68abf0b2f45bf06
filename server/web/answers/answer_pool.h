#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/point_table.h"
#include "proto/wire/chunk.h"
#include "server/web/answers/service_line.h"
#include "server/web/http/http_message.h"

namespace oblique::server {

/// A study as reported by the service.
struct ServedStudy {
  /// Whether the filter leaves out a point that has no row. In a study that is done it does: the
  /// worker decided, whose values may differ from those of this machine in the last digit.
  bool leaves_out(std::uint64_t point) const {
    return table->has_filter() && (state == "done" || !table->is_left_in(point));
  }

  std::uint64_t id;
  std::string name;
  std::string state;
  std::uint64_t failed;  ///< number of failed points
  std::shared_ptr<const protocol::PointTable> table;
};

/// Ends a job with an error as its answer.
class JobError : public std::exception {
 public:
  explicit JobError(HttpAnswer answer) : answer_(std::move(answer)) {}
  const HttpAnswer& answer() const { return answer_; }
  const char* what() const noexcept override { return answer_.body.c_str(); }

 private:
  HttpAnswer answer_;
};

/// Sends a job's requests to the service and waits for the replies. Each function throws JobError
/// for an error of the service, and when the job is over.
class JobContext {
 public:
  /// `is_over` returns whether the client has disconnected or the time limit has passed.
  JobContext(ServiceLine& service, std::function<bool()> is_over)
      : service_(service), is_over_(std::move(is_over)) {}

  ServedStudy study(std::uint64_t id) const;

  /// Receives the rows of an answer, a chunk at a time. The query runs in a reader process, which
  /// is killed when the job is over.
  using OnRow = std::function<void(const protocol::ChunkRows&)>;
  void query(const protocol::StudyQuery& query, const OnRow& on_row) const;
  /// The same for a query that contains `condition`, a text of the user. If it is wrong, the error
  /// shows it as it was written.
  void query(const protocol::StudyQuery& query, const std::string& condition,
             const OnRow& on_row) const;

  bool is_over() const { return is_over_(); }
  /// To be called repeatedly in long computations.
  void throw_if_over() const;

 private:
  class Exchange;

  ServiceLine& service_;
  std::function<bool()> is_over_;
};

/// Threads with one queue for answers that would block the HTTP thread for too long.
class AnswerPool {
 public:
  /// Makes an answer. Throws std::invalid_argument for a wrong request, and JobError.
  using Job = std::function<HttpAnswer(const JobContext&)>;

  /// `done` is called on a thread of the pool when an answer is ready. A job is over after
  /// `time_limit`.
  AnswerPool(ServiceLine& service, std::function<void()> done,
             std::chrono::milliseconds time_limit = std::chrono::seconds(7));
  /// Calls `stop`.
  ~AnswerPool();
  AnswerPool(const AnswerPool&) = delete;
  AnswerPool& operator=(const AnswerPool&) = delete;

  /// Ends all jobs. `done` is not called any more.
  void stop();

  /// `number` is that of the HTTP request. False if too many jobs wait, and after `stop`.
  bool submit(std::uint64_t number, Job job);
  /// Removes and returns the answer; none if it is not ready.
  std::optional<HttpAnswer> take(std::uint64_t number);
  /// Ends a job whose client has disconnected.
  void forget(std::uint64_t number);

 private:
  struct QueuedJob {
    std::uint64_t number;
    Job job;
    std::shared_ptr<std::atomic<bool>> is_cancelled;
  };

  void run();
  HttpAnswer answer_to(const QueuedJob& queued);

  ServiceLine& service_;
  const std::function<void()> done_;
  const std::chrono::milliseconds time_limit_;
  std::mutex mutex_;
  std::condition_variable woken_;
  std::deque<QueuedJob> waiting_;                                        // guarded by mutex_
  std::map<std::uint64_t, std::shared_ptr<std::atomic<bool>>> running_;  // guarded by mutex_
  std::map<std::uint64_t, HttpAnswer> answers_;                          // guarded by mutex_
  bool is_stopping_ = false;                                             // guarded by mutex_
  std::vector<std::thread> threads_;  // last: they use the other members
};

}  // namespace oblique::server
