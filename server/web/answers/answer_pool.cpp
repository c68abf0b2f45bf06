#include "server/web/answers/answer_pool.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "server/database/open_for_reading.h"
#include "server/web/http/json_answer.h"

namespace oblique::server {
namespace {

using Clock = std::chrono::steady_clock;

/// One for each lane.
constexpr std::size_t kThreads = 3;
/// In each lane.
constexpr std::ptrdiff_t kMostWaiting = 64;
/// SQLite looks at the clock after so many of its steps.
constexpr int kStepsBetweenLooks = 10'000;
/// Rows that a slice reads lie apart: pages of the tree are worth keeping.
constexpr const char* kPageCache = "PRAGMA cache_size = -65536";
/// The number of no request: a column is filled.
constexpr std::uint64_t kFilling = UINT64_MAX;

}  // namespace

struct AnswerPool::Desk {
  DatabaseHandle database;
  Clock::time_point until;
  const std::atomic<bool>* is_unwanted = nullptr;

  static int is_over(void* self) {
    const Desk& desk = *static_cast<Desk*>(self);
    return *desk.is_unwanted || Clock::now() >= desk.until ? 1 : 0;
  }
};

void AnswerDesk::end_in_time(std::uint64_t point, std::uint64_t points_between_looks) const {
  if (point % points_between_looks == 0 && is_over()) {
    throw StorageError("that takes too long: ask for less");
  }
}

AnswerPool::AnswerPool(std::string database, std::function<void()> done,
                       std::chrono::milliseconds longest)
    : database_(std::move(database)), done_(std::move(done)), longest_(longest) {
  for (std::size_t i = 0; i < kThreads; ++i) {
    threads_.emplace_back([this] { run(); });
  }
}

AnswerPool::~AnswerPool() {
  stop();
}

void AnswerPool::stop() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
    for (const auto& [number, is_unwanted] : at_work_) {
      *is_unwanted = true;
    }
  }
  woken_.notify_all();
  for (std::thread& thread : threads_) {
    thread.join();
  }
  threads_.clear();
}

bool AnswerPool::submit(std::uint64_t number, Job job, Lane lane) {
  {
    const std::lock_guard lock(mutex_);
    const auto waiting = std::ranges::count(waiting_, lane, &Order::lane);
    if (is_stopping_ || waiting >= kMostWaiting) {
      return false;
    }
    if (const auto filling = at_work_.find(kFilling);
        lane == Lane::kSlow && filling != at_work_.end()) {
      *filling->second = true;  // it is read on afterwards
    }
    waiting_.push_back({number, std::move(job), std::make_shared<std::atomic<bool>>(false), lane});
  }
  woken_.notify_one();
  return true;
}

std::optional<HttpAnswer> AnswerPool::take(std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  auto answer = answers_.extract(number);
  return answer.empty() ? std::nullopt : std::optional(std::move(answer.mapped()));
}

void AnswerPool::forget(std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  std::erase_if(waiting_, [number](const Order& order) { return order.number == number; });
  answers_.erase(number);
  if (const auto order = at_work_.find(number); order != at_work_.end()) {
    *order->second = true;
  }
}

bool AnswerPool::is_taken(Lane lane) const {
  return lane != Lane::kAny && taken_.contains(lane);
}

std::optional<AnswerPool::Order> AnswerPool::next() {
  const auto found = std::find_if(waiting_.begin(), waiting_.end(),
                                  [this](const Order& order) { return !is_taken(order.lane); });
  if (found != waiting_.end()) {
    Order order = std::move(*found);
    waiting_.erase(found);
    return order;
  }
  if (is_taken(Lane::kSlow) || !columns_.has_wishes()) {
    return std::nullopt;
  }
  return Order{kFilling,
               [](const AnswerDesk& at) {
                 at.columns.fill_one(at.database, at.is_over);
                 return HttpAnswer{};
               },
               std::make_shared<std::atomic<bool>>(false), Lane::kSlow};
}

void AnswerPool::run() {
  Desk desk;
  std::unique_lock lock(mutex_);
  while (!is_stopping_) {
    const auto order = next();
    if (!order) {
      woken_.wait(lock);
      continue;
    }
    const bool is_filling = order->number == kFilling;
    taken_.insert(order->lane);
    at_work_[order->number] = order->is_unwanted;
    lock.unlock();
    desk.until = Clock::now() + longest_;
    HttpAnswer answer = answer_to(*order, desk);
    lock.lock();
    at_work_.erase(order->number);
    taken_.erase(order->lane);
    if (columns_.has_wishes() || !waiting_.empty()) {
      woken_.notify_one();
    }
    if (!is_filling && !*order->is_unwanted) {
      answers_.insert_or_assign(order->number, std::move(answer));
      done_();
    }
  }
}

HttpAnswer AnswerPool::answer_to(const Order& order, Desk& desk) {
  constexpr unsigned kBadQuestion = 400;
  constexpr unsigned kNotThere = 404;
  constexpr unsigned kFailed = 500;
  constexpr unsigned kNotNow = 503;
  desk.is_unwanted = order.is_unwanted.get();
  try {
    if (!desk.database) {
      desk.database = open_stored(database_).database;
      execute(desk.database.get(), kPageCache);
      sqlite3_progress_handler(desk.database.get(), kStepsBetweenLooks, &Desk::is_over, &desk);
    }
    return order.job({desk.database.get(), studies_, columns_, samples_,
                      [&desk] { return Desk::is_over(&desk) != 0; }});
  } catch (const std::invalid_argument& error) {
    return error_answer(kBadQuestion, error.what());
  } catch (const NothingThere& error) {
    return error_answer(kNotThere, error.what());
  } catch (const StorageError& error) {
    const bool is_late = Clock::now() >= desk.until;
    return error_answer(kNotNow, is_late ? "that takes too long: ask for less" : error.what());
  } catch (const std::exception& error) {
    return error_answer(kFailed, error.what());
  }
}

}  // namespace oblique::server
