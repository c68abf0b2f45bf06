#include "server/service/client_handler.h"

#include <algorithm>
#include <exception>
#include <iterator>
#include <optional>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "proto/wire/frame_scan.h"
#include "server/study/limits.h"

namespace oblique::server {
namespace {

/// Studies or workers in a reply; 0 requested: as many as allowed.
int page_size(std::uint32_t requested) {
  return static_cast<int>(requested == 0 ? limits::kListed : std::min(requested, limits::kListed));
}

}  // namespace

// ---- Requests ----------------------------------------------------------------------------------

void ClientHandler::frame(const std::string& identity, std::string_view frame, Instant now,
                          const std::shared_ptr<const KeyIdentity>& holder) {
  if (frame.size() > limits::kLongestInlineRequest) {
    check({identity, protocol::request_id_of(frame), holder}, frame, now);
    return;
  }
  const ReadRequest read = read_request(frame, false);
  const Client client{identity, read.request_id, holder};
  if (const std::string reason = objection_to(client, read); !reason.empty()) {
    core_.ports.reply_error(client, reason);
  } else if (read.needs_judging) {
    check(client, frame, now);
  } else {
    answer(client, read, now);
  }
}

/// Has the request read on the check thread. A client may have few such requests.
void ClientHandler::check(const Client& client, std::string_view frame, Instant now) {
  std::size_t bytes = frame.size();
  std::size_t of_all = 0;
  std::size_t of_client = 0;
  for (const auto& [ticket, request] : pending_) {
    if (request.frame == nullptr) {
      continue;
    }
    if (client.request_id != 0 && request.client == client) {
      return;  // it is sent again because the answer takes long
    }
    ++of_all;
    bytes += request.frame->size();
    of_client += request.client.identity == client.identity ? 1U : 0U;
  }
  if (stopping_) {
    core_.ports.reply_error(client, kStopping);
    return;
  }
  if (of_all >= limits::kWaitingChecks || of_client >= limits::kWaitingChecksOfClient ||
      bytes > limits::kWaitingCheckBytes) {
    core_.ports.reply_error(client, "too many long requests wait already: ask again later");
    return;
  }
  const std::uint64_t ticket = ++last_ticket_;
  auto kept = std::make_shared<const std::string>(frame);
  core_.ports.run_check([this, ticket, weak = std::weak_ptr(kept)]() -> Ports::Completion {
    const auto locked = weak.lock();
    if (locked == nullptr) {
      return [](Instant) {};  // the client is gone
    }
    ReadRequest read;
    try {
      read = read_request(*locked);
    } catch (const std::exception&) {  // there is not enough memory
      read.request_id = protocol::request_id_of(*locked);
    }
    return [this, ticket, read = std::move(read)](Instant then) { checked(ticket, read, then); };
  });
  pending_.emplace(ticket, Pending{client, std::move(kept),
                                   now.steady_ms + settings_.still_working_every_ms, true});
}

void ClientHandler::checked(std::uint64_t ticket, const ReadRequest& read, Instant now) {
  const auto request = pending_.extract(ticket);
  if (!request) {
    return;
  }
  const Client client{request.mapped().client.identity, read.request_id,
                      request.mapped().client.holder};
  if (const std::string reason = objection_to(client, read); !reason.empty()) {
    core_.ports.reply_error(client, reason);
  } else {
    answer(client, read, now);
  }
}

/// Why the request is refused whatever it asks for; empty: it is not.
std::string ClientHandler::objection_to(const Client& client, const ReadRequest& read) {
  const protocol::ClientRequest& request = read.request;
  const WriteLedger& ledger = core_.ledger;
  if (!read.is_readable) {
    bad_frames_.count("a client");
    return "the request cannot be read";
  }
  if (request.protocol_version() == 0) {
    bad_frames_.count("a client");
    return "this is the port for clients; workers connect to the other one";
  }
  if (std::string reason = protocol::objection_to_version(request.protocol_version(), "client");
      !reason.empty()) {
    return reason;
  }
  if (ledger.is_gone() && !request.has_status() && !request.has_workers()) {
    return ledger.fault();
  }
  if (request.has_submit() || request.has_change()) {
    if (client.is_reader()) {
      return fmt::format(
          "the key \"{}\" is a reader's: it may look at studies, workers and results, and change "
          "nothing",
          client.key());
    }
    if (!ledger.has_room_for_changes()) {
      return "too many changes wait for the disk already: ask again later";
    }
    if (ledger.is_slow()) {
      return fmt::format(
          "the change was not stored: the database stored nothing for over {} s. Its disk is slow "
          "or the file is damaged (`oblique check` examines it). Ask again later",
          WriteLedger::kSlowAfter_s);
    }
  }
  if (request.has_submit() && stopping_) {
    return "the server is stopping: submit again when it is back";
  }
  if (request.has_submit() && draining_) {
    return "the server is draining, that is, it waits for results under way and then stops: submit "
           "again when it is back";
  }
  return {};
}

void ClientHandler::answer(const Client& client, const ReadRequest& read, Instant now) {
  const protocol::ClientRequest& request = read.request;
  using Kind = protocol::ClientRequest;
  switch (request.kind_case()) {
    case Kind::kSubmit:
      changes_.submit(client, read, now);
      break;
    case Kind::kStatus:
      status(client, request.status(), now);
      break;
    case Kind::kWorkers:
      workers(client, request.workers(), now);
      break;
    case Kind::kChange:
      changes_.change(client, request.change(), now);
      break;
    case Kind::kQuery:
      query(client, request.query(), now);
      break;
    case Kind::kDescribe:
      describe(client, request.describe());
      break;
    case Kind::kTrace:
      trace(client, request.trace(), now);
      break;
    case Kind::kMoreRows:
      more_rows(client, request.more_rows());
      break;
    case Kind::kEndQuery:
      end_query(client, request.end_query().request_id());
      break;
    case Kind::KIND_NOT_SET:
      bad_frames_.count("a client");
      core_.ports.reply_error(client, "the server does not know this kind of request");
      break;
  }
}

// ---- Queries -----------------------------------------------------------------------------------

void ClientHandler::query(const Client& client, const protocol::QueryRequest& request,
                          Instant now) {
  if (find(client.identity, client.request_id) != pending_.end()) {
    return;  // it is sent again because the answer takes long
  }
  const std::uint64_t ticket = ++last_ticket_;
  if (stopping_) {
    core_.ports.reply_error(client, kStopping);
  } else if (!core_.ports.query({ticket, client.share(), request})) {
    core_.ports.reply_error(client, "too many queries wait already: ask again later");
  } else {
    pending_.emplace(ticket,
                     Pending{client, nullptr, now.steady_ms + settings_.still_working_every_ms});
  }
}

void ClientHandler::more_rows(const Client& client, const protocol::MoreRows& request) {
  const Client asker{client.identity, request.request_id(), client.holder};
  const auto found = find(asker.identity, asker.request_id);
  if (found == pending_.end()) {
    core_.ports.reply_error(asker, "no answer to that request is under way");
  } else if (request.taken() > found->second.sent) {
    cancel(found);
    core_.ports.reply_error(asker, "more of the answer was taken than was given");
  } else if (request.taken() > found->second.taken) {
    found->second.taken = request.taken();
    core_.ports.more_rows(found->first, request.taken());
  }
}

void ClientHandler::end_query(const Client& client, std::uint64_t request_id) {
  if (const auto found = find(client.identity, request_id); found != pending_.end()) {
    cancel(found);
  }
  traces_.end(client.identity, request_id);
}

void ClientHandler::query_report(QueryReport report) {
  const auto found = pending_.find(report.ticket);
  if (found == pending_.end()) {
    return;
  }
  Pending& query = found->second;
  if (report.kind == QueryReport::Kind::kBegun) {
    query.runs = true;
    return;
  }
  protocol::ClientReply number;
  number.set_request_id(query.client.request_id);
  // Encoded messages one after another are, decoded, one message with all their fields.
  const bool is_there =
      core_.ports.to_client(query.client.identity, protocol::encode(number) + report.reply);
  ++query.sent;
  if (report.kind == QueryReport::Kind::kAnswered) {
    pending_.erase(found);
  } else if (!is_there) {
    cancel(found);
  }
}

ClientHandler::PendingRequests::iterator ClientHandler::find(std::string_view identity,
                                                             std::uint64_t request_id) {
  return std::ranges::find_if(pending_, [&](const auto& entry) {
    const auto& [ticket, request] = entry;
    return request.frame == nullptr && request.client.request_id == request_id &&
           request.client.identity == identity;
  });
}

ClientHandler::PendingRequests::iterator ClientHandler::cancel(PendingRequests::iterator request) {
  if (request->second.frame == nullptr) {
    core_.ports.cancel_query(request->first);
  }
  return pending_.erase(request);
}

QueryCounts ClientHandler::query_counts() const {
  QueryCounts counts;
  for (const auto& [ticket, request] : pending_) {
    if (request.frame == nullptr) {
      ++(request.runs ? counts.running : counts.waiting);
    }
  }
  return counts;
}

// ---- Status ------------------------------------------------------------------------------------

protocol::StudyStatus ClientHandler::status_of(StudyId id, Instant now) const {
  protocol::StudyStatus status = study_status(id, core_, now);
  if (draining_ && status.state() == state_name(StudyState::kRunning)) {
    status.set_waits_for("the server, which is draining, to be started again");
  }
  return status;
}

void ClientHandler::status(const Client& client, const protocol::StatusRequest& request,
                           Instant now) {
  const StudyStates& states = core_.states;
  protocol::ClientReply reply;
  protocol::StatusReply& fields = *reply.mutable_status();
  fields.set_draining(draining_);
  fields.set_workers(static_cast<std::uint32_t>(core_.scheduler.workers()));
  fields.set_access(settings_.access);
  fields.set_version(settings_.version);
  if (!request.study().empty() || request.study_id() != 0) {
    const auto known = states.find_durable(request.study(), request.study_id());
    if (!known) {
      core_.ports.reply_error(client, unknown_study(request.study(), states));
      return;
    }
    *fields.add_studies() = status_of(*known, now);
    core_.ports.reply(client, std::move(reply));
    return;
  }
  const int most = page_size(request.limit());
  std::size_t bytes = 0;
  std::uint64_t last = request.after_study_id();
  while (const auto id = states.durable_after(last)) {
    if (fields.studies_size() == most || bytes > limits::kListedBytes) {
      fields.set_next_after(last);
      break;
    }
    *fields.add_studies() = status_of(*id, now);
    bytes += fields.studies(fields.studies_size() - 1).ByteSizeLong();
    last = *id;
  }
  core_.ports.reply(client, std::move(reply));
}

/// The recipe is sent as it is stored.
void ClientHandler::describe(const Client& client, const protocol::DescribeRequest& request) {
  const StudyStates& states = core_.states;
  if (const auto known = states.find_durable(request.study())) {
    protocol::ClientReply number;
    number.set_request_id(client.request_id);
    core_.ports.to_client(client.identity,
                          protocol::encode_around(
                              number, protocol::ClientReply::kDescribeFieldNumber,
                              protocol::encode_around(protocol::DescribeReply(),
                                                      protocol::DescribeReply::kRecipeFieldNumber,
                                                      states.record(*known).table.recipe_bytes())));
  } else {
    core_.ports.reply_error(client, unknown_study(request.study(), states));
  }
}

void ClientHandler::workers(const Client& client, const protocol::WorkersRequest& request,
                            Instant now) {
  protocol::ClientReply reply;
  protocol::WorkersReply& fields = *reply.mutable_workers();
  fields.set_bad_frames(bad_frames_.total());
  fields.set_access(settings_.access);
  if (request.after_worker_id() == 0) {
    core_.ports.add_peers(fields);
  }
  const int most = page_size(request.limit());
  std::uint64_t last = request.after_worker_id();
  while (const auto id = core_.workers.next_after(last)) {
    if (fields.workers_size() == most) {
      fields.set_next_after(last);
      break;
    }
    *fields.add_workers() = worker_status(*id, core_, now);
    last = *id;
  }
  core_.ports.reply(client, std::move(reply));
}

void ClientHandler::trace(const Client& client, const protocol::TraceRequest& request,
                          Instant now) {
  const StudyStates& states = core_.states;
  const auto known = states.find_durable(request.study());
  if (!known) {
    core_.ports.reply_error(client, unknown_study(request.study(), states));
    return;
  }
  const StudyRecord& study = states.record(*known);
  if (study.failures.contains(request.point()) && !request.only_point()) {
    core_.ports.reply_error(client, fmt::format("point {} of the study \"{}\" failed and has no "
                                                "trace: `oblique retry` solves it again",
                                                request.point(), study.name));
  } else {
    traces_.request(client, request, *known, study.table, now);
  }
}

// ---- Time and ends -----------------------------------------------------------------------------

void ClientHandler::tick(Instant now) {
  traces_.tick(now);
  for (auto entry = pending_.begin(); entry != pending_.end();) {
    Pending& request = entry->second;
    bool is_there = true;
    if (now.steady_ms >= request.next_sign_ms) {
      request.next_sign_ms = now.steady_ms + settings_.still_working_every_ms;
      const bool waits_for_client = request.sent == request.taken + kChunksAhead;
      is_there = waits_for_client || core_.ports.reply_still_working(request.client, request.runs);
    }
    entry = is_there ? std::next(entry) : cancel(entry);
  }
}

void ClientHandler::client_left(std::string_view identity) {
  for (auto entry = pending_.begin(); entry != pending_.end();) {
    entry = entry->second.client.identity == identity ? cancel(entry) : std::next(entry);
  }
  traces_.client_left(identity);
}

void ClientHandler::stop() {
  stopping_ = true;
  for (const auto& [ticket, request] : std::exchange(pending_, {})) {
    core_.ports.reply_error(request.client, kStopping);
  }
  traces_.stop();
}

}  // namespace oblique::server
