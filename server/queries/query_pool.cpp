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
/// An answer whose client takes nothing is looked at again after this, and one that can be gone on
/// with leaves its reader to others.
constexpr std::int64_t kIdle_ms = 100;

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

void QueryPool::more(std::uint64_t ticket, std::uint64_t taken) {
  const std::lock_guard lock(mutex_);
  wishes_[ticket] = taken;
  woken_.wake();
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

std::int64_t QueryPool::time_ms() const {
  return settings_.clock_ms ? settings_.clock_ms() : steady_ms();
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
  take_wishes();
  for (Slot& slot : slots_) {
    if (slot.process != nullptr) {
      look_after(slot, time_ms());
    }
  }
  make_room(time_ms());
  begin_queries(time_ms());
  free_from_idle_clients(time_ms());
  begin_queries(time_ms());  // with the readers that were freed just now
  std::erase_if(slots_, [](const Slot& slot) { return slot.process == nullptr; });
  std::erase_if(dying_, [](const auto& process) { return process->is_gone(); });
  wait(time_ms());
}

void QueryPool::wait(std::int64_t now_ms) {
  std::vector<pollfd> items{{woken_.descriptor(), POLLIN, 0}};
  std::int64_t until_ms = now_ms + kLongWait_ms;
  bool ends_soon = !dying_.empty();
  for (const Slot& slot : slots_) {
    if (slot.stands_since_ms) {
      until_ms = std::min(until_ms, now_ms + kIdle_ms);
      continue;
    }
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

void QueryPool::take_wishes() {
  std::vector<std::uint64_t> unwanted;
  std::map<std::uint64_t, std::uint64_t> wishes;
  {
    const std::lock_guard lock(mutex_);
    unwanted = std::exchange(unwanted_, {});
    wishes = std::exchange(wishes_, {});
  }
  for (const auto& [ticket, taken] : wishes) {
    if (const auto found = taken_.find(ticket); found != taken_.end()) {
      found->second = std::max(found->second, taken);
      const std::lock_guard lock(mutex_);
      turns_.unpark(ticket);
    }
  }
  for (const std::uint64_t ticket : unwanted) {
    drop(ticket);
  }
}

void QueryPool::drop(std::uint64_t ticket) {
  forget(ticket);
  if (Slot* slot = slot_of(ticket); slot != nullptr) {
    end_process(*slot);
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

/// Who does not take what was asked for keeps no reader from others, nor the log from being
/// emptied.
void QueryPool::free_from_idle_clients(std::int64_t now_ms) {
  for (Slot& slot : slots_) {
    if (slot.process == nullptr || !slot.stands_since_ms || may_give(slot)) {
      continue;
    }
    const std::int64_t stands_ms = now_ms - *slot.stands_since_ms;
    std::unique_lock lock(mutex_);
    const bool is_in_the_way = turns_.is_in_the_way(slot.ticket);
    if (slot.can_go_on && stands_ms >= kIdle_ms && is_in_the_way && turns_.park(slot.ticket)) {
      lock.unlock();
      report_({QueryReport::Kind::kPutBack, slot.ticket, {}});
      end_process(slot);
      continue;
    }
    lock.unlock();
    if (slot.is_bound && slot.stood_ms + stands_ms >= settings_.patience_ms &&
        (is_in_the_way || log_bytes(database_) >= settings_.long_log_bytes)) {
      end_process(slot);
      finish(slot, encoded_error(
                       std::string("the answer was ended in the middle: nothing of it was taken "
                                   "for long, and ") +
                       (is_in_the_way ? "others wait for its turn"
                                      : "the database cannot empty its log meanwhile") +
                       ". Write it to a file first, or ask in the order of points, which can "
                       "wait"));
    }
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
    slot.given = job.request.after().chunks();
    slot.can_go_on = false;
    slot.is_bound = false;
    slot.stood_ms = 0;
    taken_.try_emplace(job.ticket, slot.given);
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

bool QueryPool::may_give(const Slot& slot) const {
  const auto taken = taken_.find(slot.ticket);
  return taken == taken_.end() || slot.given < taken->second + kChunksAhead;
}

void QueryPool::look_after(Slot& slot, std::int64_t now_ms) {
  using State = ReaderProcess::State;
  bool gives = may_give(slot);
  while (gives && slot.process->advance() == State::kAnswered) {
    gives = give(slot, now_ms) && may_give(slot);
  }
  note_standing(slot, !gives, now_ms);
  if (!gives) {
    return;
  }
  if (slot.process->state() == State::kEnded && slot.ticket == 0) {
    end_process(slot);
  } else if (slot.process->state() == State::kEnded) {
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

/// While it may not give, its time stands still too.
void QueryPool::note_standing(Slot& slot, bool stands, std::int64_t now_ms) {
  if (stands) {
    slot.stands_since_ms = slot.stands_since_ms.value_or(now_ms);
  } else if (slot.stands_since_ms) {
    const std::int64_t stood_ms = now_ms - *std::exchange(slot.stands_since_ms, std::nullopt);
    slot.stood_ms += stood_ms;
    slot.deadline_ms += stood_ms;
  }
}

/// Passes on a frame of the answer. False when it must wait: it would bind one reader too many.
bool QueryPool::give(Slot& slot, std::int64_t now_ms) {
  const AnswerHead head = slot.process->head();
  if (head.ends != 0) {
    finish(slot, slot.process->take_answer().reply);
    return true;
  }
  protocol::GivenRows given;
  given.set_last_point(head.last_point);
  given.set_rows(head.rows);
  given.set_chunks(head.chunks);
  slot.can_go_on = head.can_go_on != 0;
  {
    const std::lock_guard lock(mutex_);
    if (slot.can_go_on) {
      turns_.note_given(slot.ticket, given);
    } else if (!slot.is_bound && !turns_.bind(slot.ticket)) {
      return false;
    }
  }
  slot.stands_since_ms.reset();  // what it waited for was another reader, not its client
  slot.is_bound = !slot.can_go_on;
  slot.given = head.chunks;
  slot.deadline_ms = now_ms + slot.time_limit_ms + settings_.grace_ms;
  report_({QueryReport::Kind::kRows, slot.ticket, slot.process->take_answer().reply});
  return true;
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
  taken_.erase(ticket);
  const std::lock_guard lock(mutex_);
  turns_.remove(ticket);
}

}  // namespace oblique::server
