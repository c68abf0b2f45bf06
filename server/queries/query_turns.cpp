#include "server/queries/query_turns.h"

#include <algorithm>
#include <utility>

namespace oblique::server {
namespace {

std::size_t bytes_of(const QueryJob& job) {
  return job.request.sql().size() +
         (job.request.has_question() ? job.request.question().ByteSizeLong() : 0);
}

}  // namespace

bool QueryTurns::add(QueryJob job) {
  const std::size_t bytes = bytes_of(job);
  if (waiting_ >= settings_.most_waiting || waiting_bytes_ + bytes > settings_.most_waiting_bytes) {
    return false;
  }
  const auto [found, is_new] = clients_.try_emplace(job.client);
  Client& client = found->second;
  if (client.fresh.size() + client.slow.size() + client.parked.size() >=
      settings_.most_waiting_each) {
    return false;
  }
  if (is_new) {
    client.turn = ++last_turn_;
  }
  client.fresh.push_back(std::move(job));
  ++waiting_;
  waiting_bytes_ += bytes;
  return true;
}

bool QueryTurns::is_slow(const Running& running, std::int64_t now_ms) const {
  return running.was_put_back || now_ms - running.begun_ms >= settings_.quick_ms;
}

std::size_t QueryTurns::slow_running(std::int64_t now_ms) const {
  return static_cast<std::size_t>(
      std::count_if(running_.begin(), running_.end(),
                    [&](const auto& entry) { return is_slow(entry.second, now_ms); }));
}

QueryTurns::Client* QueryTurns::next_client(Lane lane) {
  Client* next = nullptr;
  for (auto& [identity, client] : clients_) {
    const bool may_run = !(client.*lane).empty() && client.running < settings_.most_running_each;
    if (may_run && (next == nullptr || client.turn < next->turn)) {
      next = &client;
    }
  }
  return next;
}

QueryJob QueryTurns::take(Client& client, Lane lane, std::int64_t now_ms) {
  QueryJob job = std::move((client.*lane).front());
  (client.*lane).pop_front();
  ++client.running;
  client.turn = ++last_turn_;
  --waiting_;
  waiting_bytes_ -= bytes_of(job);
  running_.emplace(job.ticket, Running{job, now_ms, last_turn_, lane == &Client::slow});
  return job;
}

std::optional<QueryJob> QueryTurns::begin(std::int64_t now_ms) {
  if (running_.size() >= settings_.readers) {
    return std::nullopt;
  }
  // Slow ones have half of the readers for certain, and all but one while nothing else waits.
  const std::size_t slow = slow_running(now_ms);
  Client* const of_fresh = next_client(&Client::fresh);
  Client* const of_slow = next_client(&Client::slow);
  const bool slow_first = slow < settings_.readers / 2 || of_fresh == nullptr;
  if (of_slow != nullptr && slow_first && slow + 1 < settings_.readers) {
    return take(*of_slow, &Client::slow, now_ms);
  }
  if (of_fresh != nullptr) {
    return take(*of_fresh, &Client::fresh, now_ms);
  }
  return std::nullopt;
}

bool QueryTurns::bind(std::uint64_t ticket) {
  const auto bound = std::count_if(running_.begin(), running_.end(),
                                   [](const auto& entry) { return entry.second.is_bound; });
  Running& running = running_.at(ticket);
  running.is_bound = running.is_bound || static_cast<std::size_t>(bound) + 1 < settings_.readers;
  return running.is_bound;
}

void QueryTurns::note_given(std::uint64_t ticket, const protocol::GivenRows& given) {
  *running_.at(ticket).job.request.mutable_after() = given;
}

bool QueryTurns::is_in_the_way(std::uint64_t ticket) const {
  const bool is_full = running_.size() >= settings_.readers;
  return std::any_of(clients_.begin(), clients_.end(), [&](const auto& entry) {
    const auto& [identity, client] = entry;
    const bool waits = !client.fresh.empty() || !client.slow.empty();
    const bool may_run = client.running < settings_.most_running_each;
    const bool is_its_own = running_.at(ticket).job.client == identity;
    return waits && (is_its_own || (is_full && may_run));
  });
}

bool QueryTurns::park(std::uint64_t ticket) {
  if (parked_ >= settings_.most_parked) {
    return false;
  }
  auto running = running_.extract(ticket);
  QueryJob& job = running.mapped().job;
  Client& client = clients_.at(job.client);
  --client.running;
  ++parked_;
  client.parked.emplace(ticket, std::move(job));
  return true;
}

void QueryTurns::unpark(std::uint64_t ticket) {
  const auto found = std::find_if(clients_.begin(), clients_.end(), [&](const auto& entry) {
    return entry.second.parked.contains(ticket);
  });
  if (found == clients_.end()) {
    return;
  }
  auto parked = found->second.parked.extract(ticket);
  --parked_;
  ++waiting_;
  waiting_bytes_ += bytes_of(parked.mapped());
  found->second.fresh.push_front(std::move(parked.mapped()));
}

std::optional<std::uint64_t> QueryTurns::put_back(std::int64_t now_ms) {
  if (running_.size() < settings_.readers || slow_running(now_ms) < settings_.readers ||
      next_client(&Client::fresh) == nullptr) {
    return std::nullopt;
  }
  const auto rank = [](const Running& running) {
    return std::pair(!running.is_bound, running.turn);
  };
  const auto last = std::max_element(
      running_.begin(), running_.end(),
      [&](const auto& a, const auto& b) { return rank(a.second) < rank(b.second); });
  if (last->second.is_bound) {
    return std::nullopt;
  }
  QueryJob job = std::move(last->second.job);
  const std::uint64_t ticket = job.ticket;
  running_.erase(last);
  Client& client = clients_.at(job.client);
  --client.running;
  ++waiting_;
  waiting_bytes_ += bytes_of(job);
  client.slow.push_front(std::move(job));
  return ticket;
}

std::optional<std::int64_t> QueryTurns::next_change_ms(std::int64_t now_ms) const {
  std::optional<std::int64_t> next;
  for (const auto& [ticket, running] : running_) {
    if (!is_slow(running, now_ms)) {
      const std::int64_t slow_at_ms = running.begun_ms + settings_.quick_ms;
      next = std::min(next.value_or(slow_at_ms), slow_at_ms);
    }
  }
  return waiting_ > 0 ? next : std::nullopt;
}

void QueryTurns::remove(std::uint64_t ticket) {
  if (const auto found = running_.find(ticket); found != running_.end()) {
    const std::string client = found->second.job.client;
    running_.erase(found);
    --clients_.at(client).running;
    forget_if_idle(client);
    return;
  }
  for (auto& [identity, client] : clients_) {
    if (client.parked.erase(ticket) > 0) {
      --parked_;
      forget_if_idle(std::string(identity));
      return;
    }
    for (const Lane lane : {&Client::fresh, &Client::slow}) {
      auto& jobs = client.*lane;
      const auto found = std::find_if(jobs.begin(), jobs.end(),
                                      [&](const QueryJob& job) { return job.ticket == ticket; });
      if (found != jobs.end()) {
        --waiting_;
        waiting_bytes_ -= bytes_of(*found);
        jobs.erase(found);
        forget_if_idle(std::string(identity));
        return;
      }
    }
  }
}

void QueryTurns::forget_if_idle(const std::string& client) {
  const auto found = clients_.find(client);
  const Client& state = found->second;
  if (state.running == 0 && state.fresh.empty() && state.slow.empty() && state.parked.empty()) {
    clients_.erase(found);
  }
}

}  // namespace oblique::server
