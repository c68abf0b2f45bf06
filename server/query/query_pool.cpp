#include "server/query/query_pool.h"

#include <algorithm>
#include <utility>

#include <poll.h>

#include "proto/frames.h"
#include "server/query/query_rules.h"

namespace oblique::server {
namespace {

/// Pause after a turn of the thread that threw.
constexpr std::chrono::milliseconds kRetryPause{20};
constexpr std::int64_t kLongestWait_ms = 60'000;
/// Number of chunks that marks a cancelled query.
constexpr std::uint64_t kCancelled = UINT64_MAX;

std::size_t bytes_of(const QueryJob& job) {
  return job.request.ByteSizeLong();
}

}  // namespace

bool QueryQueue::add(QueryJob job) {
  std::size_t waiting = 0;
  std::size_t bytes = bytes_of(job);
  for (const Client& client : clients_) {
    waiting += client.waiting.size();
    for (const QueryJob& other : client.waiting) {
      bytes += bytes_of(other);
    }
  }
  if (waiting >= settings_.most_waiting || bytes > settings_.most_waiting_bytes) {
    return false;
  }
  auto client = std::find_if(clients_.begin(), clients_.end(),
                             [&](const Client& each) { return each.name == job.client; });
  if (client == clients_.end()) {
    client = clients_.insert(clients_.end(), Client{job.client});
  } else if (client->waiting.size() >= settings_.most_waiting_each) {
    return false;
  }
  client->waiting.push_back(std::move(job));
  return true;
}

std::optional<QueryJob> QueryQueue::start_next() {
  std::size_t running = 0;
  for (const Client& client : clients_) {
    running += client.running.size();
  }
  const auto next = std::find_if(clients_.begin(), clients_.end(), [this](const Client& client) {
    return !client.waiting.empty() && client.running.size() < settings_.most_running_each;
  });
  if (running >= settings_.readers || next == clients_.end()) {
    return std::nullopt;
  }
  QueryJob job = std::move(next->waiting.front());
  next->waiting.pop_front();
  next->running.insert(job.ticket);
  clients_.splice(clients_.end(), clients_, next);
  return job;
}

void QueryQueue::remove(std::uint64_t ticket) {
  for (Client& client : clients_) {
    client.running.erase(ticket);
    std::erase_if(client.waiting, [&](const QueryJob& job) { return job.ticket == ticket; });
  }
  std::erase_if(clients_, [](const Client& client) {
    return client.waiting.empty() && client.running.empty();
  });
}

QueryPool::QueryPool(std::string database, QueryPoolSettings settings, Report report)
    : database_(std::move(database)),
      settings_(std::move(settings)),
      report_(std::move(report)),
      queue_(settings_.queue),
      thread_([this] { run(); }) {}

QueryPool::~QueryPool() {
  stop();
}

bool QueryPool::submit(QueryJob job) {
  const std::lock_guard lock(mutex_);
  if (stopping_ || !queue_.add(std::move(job))) {
    return false;
  }
  woken_.wake();
  return true;
}

void QueryPool::more(std::uint64_t ticket, std::uint64_t taken) {
  const std::lock_guard lock(mutex_);
  std::uint64_t& known = taken_[ticket];
  known = std::max(known, taken);
  woken_.wake();
}

void QueryPool::cancel(std::uint64_t ticket) {
  more(ticket, kCancelled);
}

void QueryPool::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    woken_.wake();
  }
  if (thread_.joinable()) {
    thread_.join();
  }
}

void QueryPool::run() {
  const auto is_stopping = [this] {
    const std::lock_guard lock(mutex_);
    return stopping_;
  };
  while (!is_stopping()) {
    try {
      take_requests();
      for (Slot& slot : slots_) {
        read(slot);
        check_deadline(slot);
      }
      std::erase_if(slots_, [](const Slot& slot) { return slot.process == nullptr; });
      while (start_next()) {
      }
      wait();
    } catch (const std::exception&) {
      // For example std::bad_alloc. The next turn continues.
      std::this_thread::sleep_for(kRetryPause);
    }
  }
  // Kills all processes before it waits for the first one.
  for (Slot& slot : slots_) {
    if (slot.process != nullptr) {
      slot.process->kill();
    }
  }
  slots_.clear();
}

/// Waits for input from a process, a call from another thread, or a deadline.
void QueryPool::wait() {
  std::vector<pollfd> items{{woken_.descriptor(), POLLIN, 0}};
  const std::int64_t now_ms = settings_.now_ms();
  std::int64_t until_ms = now_ms + kLongestWait_ms;
  for (const Slot& slot : slots_) {
    if (!slot.waits_for_client()) {
      items.push_back({slot.process->descriptor(), slot.process->events(), 0});
    }
    if (slot.ticket != 0) {
      until_ms = std::min({until_ms, slot.deadline_ms, slot.answer_ends_ms});
    }
  }
  const std::int64_t left_ms = std::max<std::int64_t>(until_ms - now_ms, 0);
  (void)::poll(items.data(), items.size(), static_cast<int>(left_ms));
  woken_.clear();
}

void QueryPool::take_requests() {
  std::map<std::uint64_t, std::uint64_t> taken;
  {
    const std::lock_guard lock(mutex_);
    taken = std::exchange(taken_, {});
  }
  for (const auto& request : taken) {
    if (request.second == kCancelled) {
      forget(request.first);
      std::erase_if(slots_, [&](const Slot& slot) { return slot.ticket == request.first; });
      continue;
    }
    for (Slot& slot : slots_) {
      if (slot.ticket == request.first && request.second > slot.taken) {
        const bool waited = slot.waits_for_client();
        slot.taken = request.second;
        slot.deadline_ms = waited ? settings_.now_ms() + slot.time_limit_ms : slot.deadline_ms;
      }
    }
  }
}

/// Starts the next query that may run. False: there is none.
bool QueryPool::start_next() {
  std::optional<QueryJob> job;
  {
    const std::lock_guard lock(mutex_);
    job = queue_.start_next();
  }
  if (!job) {
    return false;
  }
  try {
    auto slot = std::ranges::find(slots_, std::uint64_t{0}, &Slot::ticket);
    if (slot == slots_.end()) {
      slots_.push_back({std::make_unique<ReaderProcess>(settings_.reader_program, database_)});
      slot = slots_.end() - 1;
    }
    slot->process->ask(protocol::encode(job->request));
    slot->ticket = job->ticket;
    slot->time_limit_ms = time_limit_of(job->request);
    slot->deadline_ms = settings_.now_ms() + slot->time_limit_ms;
    slot->answer_ends_ms = settings_.now_ms() + settings_.longest_answer_ms;
    slot->given = 0;
    slot->taken = 0;
    report_({QueryReport::Kind::kBegun, job->ticket, {}});
  } catch (const std::exception& error) {
    forget(job->ticket);
    std::erase_if(slots_, [&](const Slot& slot) { return slot.ticket == job->ticket; });
    report_(
        {QueryReport::Kind::kAnswered, job->ticket,
         encoded_error(std::string("no process can be started for the query: ") + error.what())});
  }
  return true;
}

/// Reports the received frames, up to kChunksAhead more than the client has taken.
void QueryPool::read(Slot& slot) {
  while (!slot.waits_for_client()) {
    auto frame = slot.process->read();
    if (slot.process->is_broken() || (frame && slot.ticket == 0)) {
      fail(slot,
           "the process that ran the query has ended: it may have needed more memory than there "
           "is");
      return;
    }
    if (!frame) {
      return;
    }
    if (frame->is_last) {
      finish(slot, std::move(frame->reply));
      continue;
    }
    ++slot.given;
    slot.deadline_ms =
        settings_.now_ms() + (slot.waits_for_client() ? settings_.patience_ms : slot.time_limit_ms);
    report_({QueryReport::Kind::kRows, slot.ticket, std::move(frame->reply)});
  }
}

void QueryPool::check_deadline(Slot& slot) {
  const std::int64_t now_ms = settings_.now_ms();
  if (slot.ticket == 0 || (now_ms < slot.deadline_ms && now_ms < slot.answer_ends_ms)) {
    return;
  }
  if (now_ms < slot.deadline_ms) {
    fail(slot, "the answer took more than " + std::to_string(settings_.longest_answer_ms / 1000) +
                   " s in all: narrow it, as with WHERE or LIMIT, or read the file with --db");
  } else if (slot.waits_for_client()) {
    fail(slot, "the answer was ended in the middle: its client took no rows for " +
                   std::to_string(settings_.patience_ms / 1000) + " s. Write it to a file first");
  } else {
    fail(slot, took_too_long(slot.time_limit_ms));
  }
}

/// Reports the last part of an answer and frees the process for another query.
void QueryPool::finish(Slot& slot, std::string reply) {
  const std::uint64_t ticket = std::exchange(slot.ticket, 0);
  forget(ticket);
  report_({QueryReport::Kind::kAnswered, ticket, std::move(reply)});
}

/// Answers the query of the slot, if any, with an error, and ends the process.
void QueryPool::fail(Slot& slot, const std::string& message) {
  slot.process.reset();
  if (slot.ticket != 0) {
    finish(slot, encoded_error(message));
  }
}

void QueryPool::forget(std::uint64_t ticket) {
  const std::lock_guard lock(mutex_);
  queue_.remove(ticket);
}

}  // namespace oblique::server
