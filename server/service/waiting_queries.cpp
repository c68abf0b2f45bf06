#include "server/service/waiting_queries.h"

#include <algorithm>
#include <utility>

#include "proto/frames.h"

namespace oblique::server {
namespace {

constexpr const char* kStopping = "the server is stopping: ask again when it runs";

}  // namespace

void WaitingQueries::ask(const Client& client, const protocol::QueryRequest& request, Instant now) {
  if (find(client.identity, client.request_id) != queries_.end()) {
    return;  // the answer is on its way
  }
  if (stopping_) {
    clients_.reply_error(client, kStopping);
    return;
  }
  const std::uint64_t ticket = ++last_ticket_;
  if (!readers_.query({ticket, client.identity, request})) {
    clients_.reply_error(client, "too many queries wait already: ask again later");
    return;
  }
  queries_.emplace(ticket, Query{client, now.steady_ms + word_every_ms_});
}

WaitingQueries::Queries::iterator WaitingQueries::find(std::string_view identity,
                                                       std::uint64_t request_id) {
  return std::find_if(queries_.begin(), queries_.end(), [&](const auto& entry) {
    const Client& client = entry.second.client;
    return client.request_id == request_id && client.identity == identity;
  });
}

void WaitingQueries::cancel(Queries::iterator query) {
  readers_.cancel_query(query->first);
  queries_.erase(query);
}

void WaitingQueries::more(const Client& client, const protocol::MoreRows& wish) {
  const Client asker{client.identity, wish.request_id(), client.holder};
  const auto found = find(asker.identity, asker.request_id);
  if (found == queries_.end()) {
    clients_.reply_error(asker, "no answer to that request is under way");
  } else if (wish.taken() > found->second.given) {
    cancel(found);
    clients_.reply_error(asker, "more of the answer was taken than was given");
  } else if (wish.taken() > found->second.taken) {
    found->second.taken = wish.taken();
    readers_.more_rows(found->first, wish.taken());
  }
}

void WaitingQueries::end(std::string_view identity, std::uint64_t request_id) {
  if (const auto found = find(identity, request_id); found != queries_.end()) {
    cancel(found);
  }
}

void WaitingQueries::report(QueryReport report) {
  const auto found = queries_.find(report.ticket);
  if (found == queries_.end()) {
    return;
  }
  using Kind = QueryReport::Kind;
  if (report.kind == Kind::kBegun) {
    found->second.runs = true;
    return;
  }
  if (report.kind == Kind::kRows) {
    const Client& asker = found->second.client;
    ++found->second.given;
    if (!clients_.forward_to_client(asker.identity,
                                    protocol::with_request_id(asker.request_id, report.reply))) {
      cancel(found);
    }
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
  if (query.waits_for_client()) {
    return true;
  }
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
