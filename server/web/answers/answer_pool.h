#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "server/web/answers/column_store.h"
#include "server/web/answers/result_sample.h"
#include "server/web/answers/study_book.h"
#include "server/web/http/http_message.h"

namespace oblique::server {

/// What a job has: a connection to the database that only reads, and what all jobs share.
struct AnswerDesk {
  sqlite3* database;
  StudyBook& studies;
  ColumnStore& columns;
  SampleBook& samples;
  std::function<bool()> is_over;  ///< nobody waits any more, or the time is up

  /// For what goes through many points: throws StorageError when it is over, at every so manyth.
  void end_in_time(std::uint64_t point, std::uint64_t points_between_looks = 65'536) const;
};

/// Answers that are made of the database, on a few threads of their own with a connection each: a
/// statement here is ours, reads by key, and ends in time or when nobody waits for it any more.
class AnswerPool {
 public:
  /// Throws std::invalid_argument for a wrong question, NothingThere, StorageError.
  using Job = std::function<HttpAnswer(const AnswerDesk&)>;
  /// Status of what a job gives that is only the first step to an answer.
  static constexpr unsigned kStep = 0;

  /// `done` is called on a thread of the pool when an answer can be taken. The database is opened
  /// by the first job.
  /// A job ends after `longest` at the latest; of filling, what it has is kept.
  AnswerPool(std::string database, std::function<void()> done,
             std::chrono::milliseconds longest = std::chrono::seconds(7));
  /// Stops.
  ~AnswerPool();
  AnswerPool(const AnswerPool&) = delete;
  AnswerPool& operator=(const AnswerPool&) = delete;

  /// Ends all jobs; `done` is not called any more, and nothing is taken.
  void stop();

  /// What is done one at a time of each of the latter two, so that others are always answered:
  /// counting what filters leave in, for which filling columns that nobody waits for makes way; and
  /// whatever those ask who come without the token.
  enum class Lane { kAny, kSlow, kStrangers };

  /// False when too many of that lane wait already, and after `stop`.
  bool submit(std::uint64_t number, Job job, Lane lane = Lane::kAny);
  /// The answer, once; nothing: it is not made yet.
  std::optional<HttpAnswer> take(std::uint64_t number);
  /// Nobody waits for it any more.
  void forget(std::uint64_t number);

 private:
  struct Order {
    std::uint64_t number;
    Job job;
    std::shared_ptr<std::atomic<bool>> is_unwanted;
    Lane lane = Lane::kAny;
  };
  struct Desk;

  bool is_taken(Lane lane) const;  ///< with mutex_ locked
  /// The next that may begin; it waits no more. Nothing: none may. With mutex_ locked.
  std::optional<Order> next();

  void run();
  HttpAnswer answer_to(const Order& order, Desk& desk);

  const std::string database_;
  const std::function<void()> done_;
  const std::chrono::milliseconds longest_;
  StudyBook studies_;
  ColumnStore columns_;
  SampleBook samples_;
  std::mutex mutex_;
  std::condition_variable woken_;
  std::deque<Order> waiting_;                                            // guarded by mutex_
  std::map<std::uint64_t, std::shared_ptr<std::atomic<bool>>> at_work_;  // guarded by mutex_
  std::map<std::uint64_t, HttpAnswer> answers_;                          // guarded by mutex_
  std::set<Lane> taken_;                                                 // guarded by mutex_
  bool is_stopping_ = false;                                             // guarded by mutex_
  std::vector<std::thread> threads_;  // last: they use all the others
};

/// What is asked for is not in the database.
class NothingThere : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace oblique::server
