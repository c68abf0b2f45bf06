#include "server/service/client_handler.h"

#include <algorithm>
#include <exception>
#include <iterator>
#include <optional>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "proto/wire/chunk.h"
#include "proto/wire/frame_scan.h"
#include "server/query/columns.h"
#include "server/study/limits.h"

namespace oblique::server {
namespace {

/// Returns the number of studies or workers for a reply. `requested` 0 stands for the maximum.
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
  ReadRequest read = read_request(frame, false);
  answer({identity, read.request_id, holder}, std::move(read), frame, now);
}

void ClientHandler::check(const Client& client, std::string_view frame, Instant now) {
  std::size_t bytes = frame.size();
  std::size_t of_all = 0;
  for (const auto& [ticket, request] : pending_) {
    if (request.frame == nullptr) {
      continue;
    }
    if (client.request_id != 0 && request.client == client) {
      return;  // the client repeats the request because the answer takes long
    }
    ++of_all;
    bytes += request.frame->size();
  }
  if (stopping_) {
    core_.ports.reply_error(client, kStopping);
    return;
  }
  if (of_all >= limits::kWaitingChecks || bytes > limits::kWaitingCheckBytes) {
    core_.ports.reply_error(client, "too many long requests are waiting: try again later");
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
    } catch (const std::exception&) {  // out of memory
      read.request_id = protocol::request_id_of(*locked);
    }
    return [this, ticket, read = std::move(read)](Instant then) mutable {
      checked(ticket, std::move(read), then);
    };
  });
  Pending& pending = add(ticket, client, now);
  pending.frame = std::move(kept);
  pending.runs = true;
}

void ClientHandler::checked(std::uint64_t ticket, ReadRequest&& read, Instant now) {
  const auto request = pending_.extract(ticket);
  if (!request) {
    return;
  }
  const Client& waiting = request.mapped().client;
  answer({waiting.identity, read.request_id, waiting.holder}, std::move(read), {}, now);
}

/// Returns why a request of any kind is refused, or an empty text.
std::string ClientHandler::request_error(const Client& client, const ReadRequest& read) {
  const protocol::ClientRequest& request = read.request;
  const WriteLedger& ledger = core_.ledger;
  if (!read.is_readable) {
    log_.bad_frame("a client");
    return "the request is not a valid message, or needs too much memory";
  }
  if (request.protocol_version() == 0) {
    log_.bad_frame("a client");
    return "this port is for clients: connect workers to the other port";
  }
  if (std::string reason = protocol::version_error(request.protocol_version(), "client");
      !reason.empty()) {
    return reason;
  }
  if (ledger.is_gone() && !request.has_status() && !request.has_workers()) {
    return ledger.fault();
  }
  if (request.has_submit() || request.has_change()) {
    if (client.is_reader()) {
      return fmt::format(
          "the key \"{}\" has the role reader: it may read studies, workers and results, and "
          "change "
          "nothing",
          client.key());
    }
    if (!ledger.has_room_for_changes()) {
      return "too many changes are waiting for the disk: try again later";
    }
    if (ledger.is_slow()) {
      return fmt::format(
          "the change was not stored, because the database has stored nothing for over {} s. Its "
          "disk is slow "
          "or the file is damaged (see `oblique check`). Try again later",
          WriteLedger::kSlowAfter_s);
    }
  }
  if (request.has_submit() && (stopping_ || draining_)) {
    return stopping_ ? "the server is stopping: submit again after its restart"
                     : "the server is draining: it waits for running batches and then "
                       "stops. Submit again after its restart";
  }
  return {};
}

void ClientHandler::answer(const Client& client, ReadRequest&& read, std::string_view frame,
                           Instant now) {
  if (const std::string reason = request_error(client, read); !reason.empty()) {
    core_.ports.reply_error(
        client, reason,
        read.is_readable ? protocol::ERROR_CODE_FAILED : protocol::ERROR_CODE_WRONG_REQUEST);
    return;
  }
  if (read.needs_point_validation) {
    return check(client, frame, now);
  }
  protocol::ClientRequest& request = read.request;
  using Kind = protocol::ClientRequest;
  switch (request.kind_case()) {
    case Kind::kSubmit:
      return changes_.submit(client, read, now);
    case Kind::kStatus:
      return status(client, request.status(), now);
    case Kind::kWorkers:
      return workers(client, request.workers(), now);
    case Kind::kChange:
      return changes_.change(client, request.change(), now);
    case Kind::kQuery:
      return query(client, std::move(*request.mutable_query()), now);
    case Kind::kDescribe:
      return describe(client, request.describe());
    case Kind::kTrace:
      return trace(client, request.trace(), now);
    case Kind::kMoreRows:
      return more_rows(client, request.more_rows());
    case Kind::kEndQuery:
      return end_query(client, request.end_query().request_id());
    case Kind::KIND_NOT_SET:
      log_.bad_frame("a client");
      core_.ports.reply_error(client, "unknown kind of request",
                              protocol::ERROR_CODE_WRONG_REQUEST);
      break;
  }
}

// ---- Queries -----------------------------------------------------------------------------------

void ClientHandler::query(const Client& client, protocol::QueryRequest request, Instant now) {
  if (find(client.identity, client.request_id) != pending_.end()) {
    return;  // the client repeats the request because the answer takes long
  }
  const std::uint64_t ticket = ++last_ticket_;
  if (stopping_) {
    core_.ports.reply_error(client, kStopping);
  } else if (!core_.ports.query({ticket, client.share(), std::move(request)})) {
    core_.ports.reply_error(client, "too many queries are waiting: try again later");
  } else {
    add(ticket, client, now);
  }
}

ClientHandler::Pending& ClientHandler::add(std::uint64_t ticket, const Client& client,
                                           Instant now) {
  return pending_.emplace(ticket, Pending{client, now.steady_ms + settings_.still_working_every_ms})
      .first->second;
}

void ClientHandler::more_rows(const Client& client, const protocol::MoreRows& request) {
  const Client asker{client.identity, request.request_id(), client.holder};
  const auto found = find(asker.identity, asker.request_id);
  if (found == pending_.end() || !found->second.is_query()) {
    core_.ports.reply_error(asker, "no query of this connection has that request number");
  } else if (request.received() > found->second.sent) {
    cancel(found);
    core_.ports.reply_error(asker, "the request confirms more chunks than were sent");
  } else if (request.received() > found->second.received) {
    found->second.received = request.received();
    core_.ports.more_rows(found->first, request.received());
  }
}

void ClientHandler::end_query(const Client& client, std::uint64_t request_id) {
  if (const auto found = find(client.identity, request_id); found != pending_.end()) {
    cancel(found);
  }
}

void ClientHandler::query_report(QueryReport report) {
  const auto found = pending_.find(report.ticket);
  if (found == pending_.end()) {
    return;
  }
  if (found->second.trace) {
    protocol::ClientReply answer;
    protocol::Table row;
    if (answer.ParseFromString(report.reply) && protocol::is_sound(answer.query())) {
      protocol::append_rows(answer.query(), row);
      use_stored_inputs(row, found->second.trace->reply);
    }
    if (report.kind == QueryReport::Kind::kAnswered) {
      inputs_found(found);
    }
    return;
  }
  Pending& query = found->second;
  if (report.kind == QueryReport::Kind::kBegun) {
    query.runs = true;
    return;
  }
  protocol::ClientReply number;
  number.set_request_id(query.client.request_id);
  // Concatenated encodings of messages decode to one message with the fields of all.
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
  if (request->second.is_query()) {
    core_.ports.cancel_query(request->first);
  }
  if (const auto& job = request->second.trace; job && job->worker) {
    // The worker may stop solving the trace. It gets its next trace order after it has answered
    // this one.
    protocol::ServerToWorker message;
    message.mutable_trace_cancel()->set_trace_id(request->first);
    core_.workers.send(*job->worker, message);
  }
  return pending_.erase(request);
}

ClientHandler::PendingRequests::iterator ClientHandler::refuse(PendingRequests::iterator request,
                                                               const std::string& reason) {
  core_.ports.reply_error(request->second.client, reason);
  return cancel(request);
}

QueryCounts ClientHandler::query_counts() const {
  QueryCounts counts;
  for (const auto& [ticket, request] : pending_) {
    if (request.is_query()) {
      ++(request.runs ? counts.running : counts.waiting);
    }
  }
  return counts;
}

// ---- Status ------------------------------------------------------------------------------------

protocol::StudyStatus ClientHandler::status_of(StudyId id, Instant now) const {
  protocol::StudyStatus status = study_status(id, core_, now);
  if (draining_ && status.state() == state_name(StudyState::kRunning)) {
    status.set_waits_for("the restart of the server, which is draining");
  }
  return status;
}

std::optional<StudyId> ClientHandler::find_study(const Client& client, const std::string& name,
                                                 StudyId id) {
  const auto known = core_.states.find_durable(name, id);
  if (!known) {
    core_.ports.reply_error(client, unknown_study(name, core_.states),
                            protocol::ERROR_CODE_NO_SUCH_STUDY);
  }
  return known;
}

void ClientHandler::status(const Client& client, const protocol::StatusRequest& request,
                           Instant now) {
  protocol::ClientReply reply;
  protocol::StatusReply& fields = *reply.mutable_status();
  fields.set_draining(draining_);
  fields.set_workers(static_cast<std::uint32_t>(core_.scheduler.workers()));
  fields.set_access(settings_.access);
  fields.set_version(settings_.version);
  if (!request.study().empty() || request.study_id() != 0) {
    if (const auto known = find_study(client, request.study(), request.study_id())) {
      *fields.add_studies() = status_of(*known, now);
      core_.ports.reply(client, std::move(reply));
    }
    return;
  }
  const int most = page_size(request.limit());
  std::size_t bytes = 0;
  std::uint64_t last = request.after_study_id();
  while (const auto id = core_.states.durable_after(last)) {
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

/// Sends the recipe as stored, without parsing it.
void ClientHandler::describe(const Client& client, const protocol::DescribeRequest& request) {
  if (const auto known = find_study(client, request.study())) {
    protocol::ClientReply number;
    number.set_request_id(client.request_id);
    core_.ports.to_client(
        client.identity,
        protocol::encode_around(
            number, protocol::ClientReply::kDescribeFieldNumber,
            protocol::encode_around(protocol::DescribeReply(),
                                    protocol::DescribeReply::kRecipeFieldNumber,
                                    core_.states.record(*known).table.recipe_bytes())));
  }
}

void ClientHandler::workers(const Client& client, const protocol::WorkersRequest& request,
                            Instant now) {
  protocol::ClientReply reply;
  protocol::WorkersReply& fields = *reply.mutable_workers();
  fields.set_bad_frames(log_.bad_frames());
  fields.set_access(settings_.access);
  if (request.after_worker_id() == 0) {
    core_.ports.add_peers(fields);
  }
  const int most = page_size(request.limit());
  std::uint64_t last = request.after_worker_id();
  const auto& workers = core_.workers.all();
  for (auto next = workers.upper_bound(last); next != workers.end(); ++next) {
    if (fields.workers_size() == most) {
      fields.set_next_after(last);
      break;
    }
    last = next->first;
    *fields.add_workers() = worker_status(last, core_, now);
  }
  core_.ports.reply(client, std::move(reply));
}

// ---- Time and ends -----------------------------------------------------------------------------

void ClientHandler::tick(Instant now) {
  for (auto entry = pending_.begin(); entry != pending_.end();) {
    Pending& request = entry->second;
    const bool runs = request.runs || (request.trace && request.trace->worker);
    if (request.trace && now.steady_ms >= request.trace->deadline_ms) {
      entry = refuse(entry, runs ? "the trace took too long: use `oblique trace --timeout SECONDS` "
                                   "for more time"
                                 : "no worker was free to solve the trace in time: "
                                   "use `oblique trace --timeout SECONDS` for more time");
      continue;
    }
    bool is_there = true;
    if (now.steady_ms >= request.next_sign_ms) {
      request.next_sign_ms = now.steady_ms + settings_.still_working_every_ms;
      const bool waits_for_client = request.sent == request.received + kChunksAhead;
      is_there = waits_for_client || core_.ports.reply_still_working(request.client, runs);
    }
    entry = is_there ? std::next(entry) : cancel(entry);
  }
  dispatch_traces();
}

void ClientHandler::client_left(std::string_view identity) {
  for (auto entry = pending_.begin(); entry != pending_.end();) {
    entry = entry->second.client.identity == identity ? cancel(entry) : std::next(entry);
  }
}

void ClientHandler::stop() {
  stopping_ = true;
  while (!pending_.empty()) {
    refuse(pending_.begin(), kStopping);
  }
}

}  // namespace oblique::server
