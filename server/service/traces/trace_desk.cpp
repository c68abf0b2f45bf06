#include "server/service/traces/trace_desk.h"

#include <algorithm>
#include <limits>
#include <set>
#include <utility>

#include <spdlog/fmt/fmt.h>

namespace oblique::server {
namespace {

/// Recipes of more bytes are read on a thread of their own.
constexpr std::size_t kLongestInlineBytes = std::size_t{64} * 1024;

constexpr const char* kTooManyTraces = "too many traces are waited for already: ask again later";
constexpr const char* kStoppingTraces = "the server is stopping: ask again when it runs";

protocol::ClientReply with_trace(protocol::TraceReply trace) {
  protocol::ClientReply reply;
  *reply.mutable_trace() = std::move(trace);
  return reply;
}

}  // namespace

void TraceDesk::ask(const Client& client, const protocol::TraceRequest& request,
                    const StudyToLookAt& study, Instant now) {
  const bool is_known = std::any_of(waiting_.begin(), waiting_.end(), [&](const auto& entry) {
    return entry.second.client == client;
  });
  if (is_known) {
    return;  // the answer is on its way
  }
  // Who has a key has one share, however many connections that is.
  const std::string asker = client.share();
  const TraceKey key{study.id, request.point(), request.shape(), request.fall()};
  if (stopping_ || is_full(asker, key)) {
    ports_.reply_error(client, stopping_ ? kStoppingTraces : kTooManyTraces);
    return;
  }
  const std::uint64_t ticket = ++last_ticket_;
  constexpr auto kLongest = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  const TraceQuestion question{
      ticket, key, request.first_row(),
      static_cast<std::int64_t>(std::min(request.time_limit_ms(), kLongest))};
  waiting_.emplace(ticket, Waiting{client, asker, question, study.solver_version,
                                   request.only_point(), now.steady_ms + word_every_ms_});
  if (!request.only_point() && orders_.answer(question, now.steady_ms)) {
    answer_what_is_done();
  } else if (!study.table.is_made() && study.table.recipe_bytes().size() > kLongestInlineBytes) {
    ports_.run_check([this, ticket, table = study.table, number = request.point()] {
      TracedPoint point = traced_point(table.recipe_bytes(), number);
      return [this, ticket, point = std::move(point)](Instant then) { found(ticket, point, then); };
    });
  } else {
    const bool is_kept = study.table.is_made();
    TracedPoint point;
    try {
      point = traced_point(*study.table.get(), request.point());
    } catch (const std::exception& error) {
      point.objection = error.what();
    }
    if (!is_kept) {
      study.table.release();
    }
    found(ticket, point, now);
  }
}

/// Whether one who asks for that trace has his share already. Who asks anew for what he waits for,
/// as a page does whose browser was answered meanwhile, takes no other's place at a worker.
bool TraceDesk::is_full(const std::string& asker, const TraceKey& key) const {
  std::size_t requests = 0;
  std::set<TraceKey> keys{key};
  for (const auto& [ticket, waiting] : waiting_) {
    if (waiting.asker == asker) {
      ++requests;
      keys.insert(waiting.question.key);
    }
  }
  return keys.size() > limits_.most_of_one || requests >= limits_.most_requests_of_one ||
         waiting_.size() >= limits_.most_waiting;
}

/// It is known what the point is; who asked may be gone.
void TraceDesk::found(std::uint64_t ticket, const TracedPoint& point, Instant now) {
  const auto entry = waiting_.find(ticket);
  if (entry == waiting_.end()) {
    return;
  }
  const Waiting& waiting = entry->second;
  if (!point.objection.empty() || waiting.only_point) {
    const Client client = waiting.client;
    protocol::TraceReply said = said_of(point);
    said.set_study_id(waiting.question.key.study);
    waiting_.erase(entry);
    if (!point.objection.empty()) {
      ports_.reply_error(client, "the point cannot be had: " + point.objection);
    } else {
      ports_.reply(client, with_trace(std::move(said)));
    }
    return;
  }
  orders_.order(waiting.question, point, waiting.version, now.steady_ms);
  answer_what_is_done();
}

void TraceDesk::answer_what_is_done() {
  for (TraceEffect& effect : orders_.take_effects()) {
    auto* answer = std::get_if<AnswerTrace>(&effect);
    auto* refusal = std::get_if<RefuseTrace>(&effect);
    if (answer == nullptr && refusal == nullptr) {
      to_workers_.push_back(std::move(effect));
      continue;
    }
    const auto entry = waiting_.find(answer != nullptr ? answer->ticket : refusal->ticket);
    if (entry == waiting_.end()) {
      continue;
    }
    const Client client = std::move(entry->second.client);
    waiting_.erase(entry);
    if (answer != nullptr) {
      ports_.reply(client, with_trace(std::move(answer->reply)));
    } else {
      ports_.reply_error(client, refusal->reason);
    }
  }
}

void TraceDesk::client_left(std::string_view identity) {
  end_those([&](const Client& client) { return client.identity == identity; });
}

void TraceDesk::end(std::string_view identity, std::uint64_t request_id) {
  end_those([&](const Client& client) {
    return client.request_id == request_id && client.identity == identity;
  });
}

void TraceDesk::end_those(const std::function<bool(const Client&)>& wait_no_more) {
  std::erase_if(waiting_, [&](const auto& entry) {
    if (!wait_no_more(entry.second.client)) {
      return false;
    }
    orders_.leave(entry.first);
    return true;
  });
  answer_what_is_done();
}

void TraceDesk::tick(Instant now) {
  orders_.tick(now.steady_ms);
  answer_what_is_done();
  for (auto entry = waiting_.begin(); entry != waiting_.end();) {
    auto& [ticket, waiting] = *entry;
    if (now.steady_ms < waiting.next_word_ms) {
      ++entry;
      continue;
    }
    waiting.next_word_ms = now.steady_ms + word_every_ms_;
    if (tell(waiting)) {
      ++entry;
    } else {
      orders_.leave(ticket);
      entry = waiting_.erase(entry);
    }
  }
  answer_what_is_done();
}

/// False when the client is gone.
bool TraceDesk::tell(const Waiting& waiting) {
  return ports_.reply_still_working(waiting.client, orders_.is_at_work(waiting.question.ticket));
}

void TraceDesk::stop() {
  stopping_ = true;
  orders_.stop(kStoppingTraces);
  answer_what_is_done();
  for (const auto& [ticket, waiting] : std::exchange(waiting_, {})) {
    ports_.reply_error(waiting.client, kStoppingTraces);
  }
}

void TraceDesk::joined(WorkerId worker, const std::string& name, const std::string& version,
                       const std::string& instruction_set) {
  orders_.joined(worker, name, version, instruction_set);
  answer_what_is_done();
}

void TraceDesk::left(WorkerId worker) {
  orders_.left(worker);
  answer_what_is_done();
}

void TraceDesk::set_busy(WorkerId worker, bool is_busy) {
  orders_.set_busy(worker, is_busy);
  answer_what_is_done();
}

void TraceDesk::part(WorkerId worker, const protocol::TracePart& part) {
  orders_.part(worker, part);
  answer_what_is_done();
}

}  // namespace oblique::server
