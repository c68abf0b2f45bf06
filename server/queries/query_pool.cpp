#include "server/queries/query_pool.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include <poll.h>

#include "proto/frames.h"
#include "server/queries/reader_program.h"
#include "server/reading/query_limits.h"

namespace oblique::server {
namespace {

/// How soon a killed process is looked at again, and a turn that failed repeated.
constexpr std::int64_t kShortWait_ms = 20;
constexpr std::int64_t kLongWait_ms = 60'000;

std::int64_t steady_ms() {
  using std::chrono::steady_clock;
  return std::chrono::duration_cast<std::chrono::milliseconds>(
             steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace

QueryPool::QueryPool(std::string database, QueryPoolSettings settings, Report report)
    : database_(std::move(database)),
      settings_(std::move(settings)),
      report_(std::move(report)),
      turns_(settings_.turns),
      thread_([this] { run(); }) {}

QueryPool::~QueryPool() {
  stop();
}

bool QueryPool::submit(QueryJob job) {
  const std::lock_guard lock(mutex_);
  if (stopping_ || !turns_.add(std::move(job))) {
    return false;
  }
  woken_.wake();
  return true;
}

void QueryPool::cancel(std::uint64_t ticket) {
  const std::lock_guard lock(mutex_);
  unwanted_.push_back(ticket);
  woken_.wake();
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
  while (true) {
    {
      const std::lock_guard lock(mutex_);
      if (stopping_) {
        break;
      }
    }
    try {
      turn();
    } catch (const std::exception&) {
      // Out of memory, say: what was not done is done in a later turn.
      std::this_thread::sleep_for(std::chrono::milliseconds(kShortWait_ms));
    }
  }
  // All are killed before the first is waited for.
  for (Slot& slot : slots_) {
    if (slot.process != nullptr) {
      slot.process->kill();
    }
  }
  slots_.clear();
  dying_.clear();
}

void QueryPool::turn() {
  drop_unwanted();
  for (Slot& slot : slots_) {
    if (slot.process != nullptr) {
      look_after(slot, steady_ms());
    }
  }
  make_room(steady_ms());
  begin_queries(steady_ms());
  std::erase_if(slots_, [](const Slot& slot) { return slot.process == nullptr; });
  std::erase_if(dying_, [](const auto& process) { return process->is_gone(); });
  wait(steady_ms());
}

void QueryPool::wait(std::int64_t now_ms) {
  std::vector<pollfd> items{{woken_.descriptor(), POLLIN, 0}};
  std::int64_t until_ms = now_ms + kLongWait_ms;
  bool ends_soon = !dying_.empty();
  for (const Slot& slot : slots_) {
    items.push_back({slot.process->descriptor(), slot.process->events(), 0});
    if (slot.ticket != 0) {
      until_ms = std::min(until_ms, slot.deadline_ms);
    }
    ends_soon = ends_soon || slot.process->descriptor() < 0;
  }
  if (ends_soon) {
    until_ms = std::min(until_ms, now_ms + kShortWait_ms);
  }
  {
    const std::lock_guard lock(mutex_);
    until_ms = std::min(until_ms, turns_.next_change_ms(now_ms).value_or(until_ms));
  }
  const std::int64_t left_ms = std::max<std::int64_t>(until_ms - now_ms, 0);
  (void)::poll(items.data(), items.size(), static_cast<int>(left_ms));
  woken_.clear();
}

void QueryPool::drop_unwanted() {
  std::vector<std::uint64_t> tickets;
  {
    const std::lock_guard lock(mutex_);
    tickets = std::exchange(unwanted_, {});
  }
  for (const std::uint64_t ticket : tickets) {
    forget(ticket);
    if (Slot* slot = slot_of(ticket); slot != nullptr) {
      end_process(*slot);
    }
  }
}

void QueryPool::make_room(std::int64_t now_ms) {
  std::optional<std::uint64_t> ticket;
  {
    const std::lock_guard lock(mutex_);
    ticket = turns_.put_back(now_ms);
  }
  if (ticket) {
    if (Slot* slot = slot_of(*ticket); slot != nullptr) {
      end_process(*slot);
    }
    report_({QueryReport::Kind::kPutBack, *ticket, {}});
  }
}

void QueryPool::begin_queries(std::int64_t now_ms) {
  while (true) {
    std::optional<QueryJob> job;
    {
      const std::lock_guard lock(mutex_);
      job = turns_.begin(now_ms);
    }
    if (!job) {
      return;
    }
    begin(*job, now_ms);
  }
}

void QueryPool::begin(const QueryJob& job, std::int64_t now_ms) {
  try {
    Slot& slot = idle_slot();
    slot.process->ask(protocol::encode(job.request));
    slot.ticket = job.ticket;
    slot.time_limit_ms = limits_of(job.request).time_limit_ms;
    slot.deadline_ms = now_ms + slot.time_limit_ms + settings_.grace_ms;
    report_({QueryReport::Kind::kBegun, job.ticket, {}});
    look_after(slot, now_ms);
  } catch (const std::exception& error) {
    forget(job.ticket);
    report_(
        {QueryReport::Kind::kAnswered, job.ticket,
         encoded_error(std::string("no process can be started for the query: ") + error.what())});
  }
}

QueryPool::Slot& QueryPool::idle_slot() {
  const auto idle = std::find_if(slots_.begin(), slots_.end(), [](const Slot& slot) {
    return slot.ticket == 0 && slot.process != nullptr;
  });
  if (idle != slots_.end()) {
    return *idle;
  }
  Slot fresh;
  fresh.process = std::make_unique<ReaderProcess>(settings_.reader_program, database_);
  slots_.push_back(std::move(fresh));
  return slots_.back();
}

void QueryPool::look_after(Slot& slot, std::int64_t now_ms) {
  using State = ReaderProcess::State;
  const State state = slot.process->advance();
  if (state == State::kAnswered) {
    finish(slot, slot.process->take_answer());
  } else if (state == State::kEnded && slot.ticket == 0) {
    end_process(slot);
  } else if (state == State::kEnded) {
    slot.process->kill();  // if it has not ended by itself
    if (slot.process->is_gone()) {
      finish(slot, encoded_error("the process that ran the query " + slot.process->ending() +
                                 ": it may have needed more memory than there is"));
      end_process(slot);
    }
  } else if (slot.ticket != 0 && now_ms >= slot.deadline_ms) {
    end_process(slot);
    finish(slot, encoded_error(took_too_long(slot.time_limit_ms)));
  }
}

/// The one who asked gets `reply`, and the place is free.
void QueryPool::finish(Slot& slot, std::string reply) {
  const std::uint64_t ticket = std::exchange(slot.ticket, 0);
  forget(ticket);
  report_({QueryReport::Kind::kAnswered, ticket, std::move(reply)});
}

void QueryPool::end_process(Slot& slot) {
  slot.process->kill();
  dying_.push_back(std::move(slot.process));
}

QueryPool::Slot* QueryPool::slot_of(std::uint64_t ticket) {
  const auto found = std::find_if(slots_.begin(), slots_.end(), [&](const Slot& slot) {
    return slot.ticket == ticket && slot.process != nullptr;
  });
  return found == slots_.end() ? nullptr : &*found;
}

void QueryPool::forget(std::uint64_t ticket) {
  const std::lock_guard lock(mutex_);
  turns_.remove(ticket);
}

}  // namespace oblique::server
