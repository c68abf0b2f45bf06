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
#include "proto/wire/chunk_rows.h"
#include "server/web/answers/service_line.h"
#include "server/web/http/http_message.h"

namespace oblique::server {

/// A study as the service reports it.
struct ServedStudy {
  /// Whether a point without a row is left out. That of a study that is done is: the filter on the
  /// machine of its worker decides, and may differ from ours in the last digit of a value.
  bool leaves_out(std::uint64_t point) const {
    return table->has_filter() && (state == "done" || !table->is_left_in(point));
  }

  std::uint64_t id;
  std::string name;
  std::string state;
  std::uint64_t failed;  ///< points
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

/// What a job works with: requests to the service, for which its thread waits. Each function throws
/// JobError for an error of the service, and when the job is over.
class JobContext {
 public:
  /// `is_over`: the client has gone, or the time is up.
  JobContext(ServiceLine& service, std::function<bool()> is_over)
      : service_(service), is_over_(std::move(is_over)) {}

  ServedStudy study(std::uint64_t id) const;

  /// Passes each row of the answer to `on_row`. A reader process of the server reads it, and is
  /// killed when the job is over.
  using OnRow = std::function<void(const protocol::ChunkRows&)>;
  void query(const protocol::StudyQuery& query, const OnRow& on_row) const;
  /// The same for a query that `condition`, which a person wrote, is part of. If the condition is
  /// wrong, the error shows it as it was written.
  void query(const protocol::StudyQuery& query, const std::string& condition,
             const OnRow& on_row) const;

  bool is_over() const { return is_over_(); }
  /// To be called now and then by what takes long.
  void throw_if_over() const;

 private:
  class Exchange;

  ServiceLine& service_;
  std::function<bool()> is_over_;
};

/// Makes answers that take longer than the HTTP thread may: a few threads, one queue.
class AnswerPool {
 public:
  /// Throws std::invalid_argument for a wrong request, JobError.
  using Job = std::function<HttpAnswer(const JobContext&)>;

  /// `done` is called on a thread of the pool when an answer can be taken. A job is over after
  /// `time_limit`.
  AnswerPool(ServiceLine& service, std::function<void()> done,
             std::chrono::milliseconds time_limit = std::chrono::seconds(7));
  /// Stops.
  ~AnswerPool();
  AnswerPool(const AnswerPool&) = delete;
  AnswerPool& operator=(const AnswerPool&) = delete;

  /// Ends all jobs. `done` is not called any more.
  void stop();

  /// `number` is that of the HTTP request. False if too many jobs wait, and after `stop`.
  bool submit(std::uint64_t number, Job job);
  /// The answer, once; nothing if it is not ready.
  std::optional<HttpAnswer> take(std::uint64_t number);
  /// Ends a job whose client has gone.
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
  std::vector<std::thread> threads_;  // last: they use all the others
};

}  // namespace oblique::server
