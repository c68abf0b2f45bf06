#include "server/web/answers/answer_pool.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "server/web/http/http_message.h"

namespace oblique::server {
namespace {

using Clock = std::chrono::steady_clock;
using protocol::ClientReply;
using protocol::ClientRequest;

/// The service runs two queries of the page at a time; the third thread makes answers without one.
constexpr std::size_t kThreads = 3;
constexpr std::size_t kMostWaiting = 64;
/// Interval at which a thread that waits for the service checks whether its job is over.
constexpr std::chrono::milliseconds kLookEvery{50};

JobError too_long() {
  return JobError(error_answer(503, "that takes too long: ask for less, as by a condition"));
}

}  // namespace

/// One request to the service and its replies. Ends a query whose answer has not ended.
class JobContext::Exchange {
 public:
  Exchange(const JobContext& context, const ClientRequest& request)
      : context_(context), number_(context.service_.new_number()) {
    context_.service_.ask(number_, request);
  }
  ~Exchange() { context_.service_.forget(number_); }
  Exchange(const Exchange&) = delete;
  Exchange& operator=(const Exchange&) = delete;

  void request_more(std::uint64_t chunks_taken) {
    ClientRequest request;
    request.mutable_more_rows()->set_request_id(number_);
    request.mutable_more_rows()->set_taken(chunks_taken);
    context_.service_.ask(number_, request);
  }
  ClientReply next() {
    while (true) {
      context_.throw_if_over();
      if (auto reply = context_.service_.wait_for_reply(number_, kLookEvery)) {
        if (reply->has_error()) {
          throw JobError(failure(reply->error()));
        }
        return *std::move(reply);
      }
    }
  }

 private:
  const JobContext& context_;
  const std::uint64_t number_;
};

ServedStudy JobContext::study(std::uint64_t id) const {
  ClientRequest request;
  request.mutable_status()->set_after_study_id(id - 1);
  request.mutable_status()->set_limit(1);
  const ClientReply status = Exchange(*this, request).next();
  if (status.status().studies_size() != 1 || status.status().studies(0).study_id() != id) {
    throw JobError(error_answer(404, "there is no such study"));
  }
  const protocol::StudyStatus& found = status.status().studies(0);
  request.mutable_describe()->set_study(found.name());
  const ClientReply described = Exchange(*this, request).next();
  return {id, found.name(), found.state(), found.failed(),
          std::make_shared<const protocol::PointTable>(described.describe().recipe())};
}

void JobContext::query(const protocol::StudyQuery& query, const OnRow& on_row) const {
  ClientRequest request;
  *request.mutable_query()->mutable_question() = query;
  Exchange exchange(*this, request);
  for (std::uint64_t chunks = 1;; ++chunks) {
    const ClientReply reply = exchange.next();
    if (!protocol::is_sound(reply.query())) {
      throw std::runtime_error("a reader process of the server sent no valid answer");
    }
    for (protocol::ChunkRows rows(reply.query()); rows.next();) {
      on_row(rows);
    }
    if (reply.query().ends()) {
      return;
    }
    exchange.request_more(chunks);
  }
}

void JobContext::query(const protocol::StudyQuery& query, const std::string& condition,
                       const OnRow& on_row) const {
  try {
    this->query(query, on_row);
  } catch (const JobError& error) {
    if (error.answer().status == 400 && !condition.empty()) {
      protocol::StudyQuery as_written;
      as_written.set_study(query.study());
      as_written.add_select("point");
      as_written.set_where(condition);
      as_written.set_limit(1);
      this->query(as_written, [](const auto&) {});
    }
    throw;
  }
}

void JobContext::throw_if_over() const {
  if (is_over()) {
    throw too_long();
  }
}

AnswerPool::AnswerPool(ServiceLine& service, std::function<void()> done,
                       std::chrono::milliseconds time_limit)
    : service_(service), done_(std::move(done)), time_limit_(time_limit) {
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
    for (const auto& [number, is_cancelled] : running_) {
      *is_cancelled = true;
    }
  }
  woken_.notify_all();
  for (std::thread& thread : threads_) {
    thread.join();
  }
  threads_.clear();
}

bool AnswerPool::submit(std::uint64_t number, Job job) {
  {
    const std::lock_guard lock(mutex_);
    if (is_stopping_ || waiting_.size() >= kMostWaiting) {
      return false;
    }
    waiting_.push_back({number, std::move(job), std::make_shared<std::atomic<bool>>(false)});
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
  std::erase_if(waiting_, [number](const QueuedJob& queued) { return queued.number == number; });
  answers_.erase(number);
  if (const auto job = running_.find(number); job != running_.end()) {
    *job->second = true;
  }
}

void AnswerPool::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    woken_.wait(lock, [this] { return is_stopping_ || !waiting_.empty(); });
    if (is_stopping_) {
      return;
    }
    const QueuedJob queued = std::move(waiting_.front());
    waiting_.pop_front();
    running_[queued.number] = queued.is_cancelled;
    lock.unlock();
    HttpAnswer answer = answer_to(queued);
    lock.lock();
    running_.erase(queued.number);
    if (!*queued.is_cancelled) {
      answers_.insert_or_assign(queued.number, std::move(answer));
      done_();
    }
  }
}

HttpAnswer AnswerPool::answer_to(const QueuedJob& queued) {
  const auto until = Clock::now() + time_limit_;
  try {
    return queued.job(
        {service_, [&queued, until] { return *queued.is_cancelled || Clock::now() >= until; }});
  } catch (const JobError& error) {
    return error.answer();
  } catch (const std::invalid_argument& error) {
    return error_answer(400, error.what());
  } catch (const std::exception& error) {
    return error_answer(500, error.what());
  }
}

}  // namespace oblique::server
