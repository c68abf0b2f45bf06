#include "server/queries/query_queue.h"

#include <algorithm>
#include <utility>

namespace oblique::server {
namespace {

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

}  // namespace oblique::server
