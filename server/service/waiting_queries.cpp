#include "server/service/waiting_queries.h"

#include <algorithm>
#include <utility>

#include "proto/frames.h"

namespace oblique::server {
namespace {

constexpr const char* kStopping = "the server is stopping: ask again when it runs";

}  // namespace

void WaitingQueries::ask(const Client& client, const protocol::QueryRequest& request, Instant now) {
  const bool is_known = std::any_of(queries_.begin(), queries_.end(), [&](const auto& entry) {
    return entry.second.client == client;
  });
  if (is_known) {
    return;  // the answer is on its way
  }
  if (stopping_) {
    clients_.reply_error(client, kStopping);
    return;
  }
  const std::uint64_t ticket = ++last_ticket_;
  // Who has a key has one share, however many connections that is.
  const std::string asker = client.holder == nullptr ? client.identity : "key " + client.key();
  if (!readers_.query({ticket, asker, request})) {
    clients_.reply_error(client, "too many queries wait already: ask again later");
    return;
  }
  queries_.emplace(ticket, Query{client, now.steady_ms + word_every_ms_});
}

void WaitingQueries::report(QueryReport report) {
  const auto found = queries_.find(report.ticket);
  if (found == queries_.end()) {
    return;
  }
  if (report.kind != QueryReport::Kind::kAnswered) {
    found->second.runs = report.kind == QueryReport::Kind::kBegun;
    return;
  }
  const Client client = std::move(found->second.client);
  queries_.erase(found);
  clients_.forward_to_client(client.identity,
                             protocol::with_request_id(client.request_id, report.reply));
}

void WaitingQueries::tick(Instant now) {
  for (auto entry = queries_.begin(); entry != queries_.end();) {
    auto& [ticket, query] = *entry;
    if (now.steady_ms < query.next_word_ms || tell(query, now)) {
      ++entry;
    } else {
      readers_.cancel_query(ticket);
      entry = queries_.erase(entry);
    }
  }
}

/// False when the client is gone.
bool WaitingQueries::tell(Query& query, Instant now) {
  query.next_word_ms = now.steady_ms + word_every_ms_;
  protocol::ClientReply word;
  word.set_request_id(kNobodysRequest);
  word.mutable_still_working()->set_request_id(query.client.request_id);
  word.mutable_still_working()->set_runs(query.runs);
  return clients_.to_client(query.client.identity, word);
}

void WaitingQueries::client_left(std::string_view identity) {
  std::erase_if(queries_, [&](const auto& entry) {
    if (entry.second.client.identity != identity) {
      return false;
    }
    readers_.cancel_query(entry.first);
    return true;
  });
}

QueryCounts WaitingQueries::counts() const {
  QueryCounts counts;
  for (const auto& [ticket, query] : queries_) {
    ++(query.runs ? counts.running : counts.waiting);
  }
  return counts;
}

void WaitingQueries::stop() {
  stopping_ = true;
  for (const auto& [ticket, query] : std::exchange(queries_, {})) {
    clients_.reply_error(query.client, kStopping);
  }
}

}  // namespace oblique::server
