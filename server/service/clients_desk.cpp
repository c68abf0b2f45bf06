#include "server/service/clients_desk.h"

#include <algorithm>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "proto/wire/frame_scan.h"
#include "server/study/limits.h"

namespace oblique::server {
namespace {

/// Lines of a page for a client that asks for so many; 0: for as many as there may be.
std::size_t page_size(std::uint32_t asked, std::size_t largest) {
  return asked == 0 ? largest : std::min<std::size_t>(asked, largest);
}

}  // namespace

ClientsDesk::ClientsDesk(const ClientsDeskSettings& settings, const Neighbours& neighbours)
    : settings_(settings),
      at_(neighbours),
      queries_(at_.clients, at_.readers, settings.still_working_every_ms) {}

void ClientsDesk::take(const std::string& identity, std::string_view frame, Instant now,
                       const std::shared_ptr<const KeyHolder>& holder) {
  if (frame.size() > limits::kLongestInlineRequest) {
    read_elsewhere({identity, protocol::request_id_of(frame), holder}, frame);
    return;
  }
  const ReadRequest read = read_request(frame, false);
  const Client client{identity, read.request_id, holder};
  if (read.needs_judging && objection_to(read).empty() && !client.is_reader()) {
    read_elsewhere(client, frame);
  } else {
    answer(client, read, now);
  }
}

void ClientsDesk::client_left(std::string_view identity) {
  std::erase_if(long_requests_, [&](const auto& entry) {
    const bool is_of_client = entry.second.client.identity == identity;
    if (is_of_client) {
      at_.readers.cancel_read(entry.first);
    }
    return is_of_client;
  });
  queries_.client_left(identity);
  at_.traces.client_left(identity);
}

void ClientsDesk::tick(Instant now) {
  queries_.tick(now);
  at_.traces.tick(now);
  if (now.steady_ms - told_ms_ < settings_.still_working_every_ms) {
    return;
  }
  told_ms_ = now.steady_ms;
  for (const auto& [ticket, request] : long_requests_) {
    if (request.client.request_id != 0) {
      protocol::ClientReply word;
      word.set_request_id(kNobodysRequest);
      word.mutable_still_working()->set_request_id(request.client.request_id);
      word.mutable_still_working()->set_runs(true);
      at_.clients.to_client(request.client.identity, word);
    }
  }
}

void ClientsDesk::read_elsewhere(const Client& client, std::string_view frame) {
  std::size_t bytes = frame.size();
  std::size_t of_connection = 0;
  for (const auto& [ticket, request] : long_requests_) {
    if (client.request_id != 0 && request.client == client) {
      return;  // it is sent again because the answer takes long; it waits already
    }
    bytes += request.bytes;
    of_connection += request.client.identity == client.identity ? 1U : 0U;
  }
  if (stopping_) {
    at_.clients.reply_error(client, "the server is stopping: ask again when it is back");
  } else if (long_requests_.size() >= limits::kLongRequests ||
             of_connection >= limits::kLongRequestsOfConnection ||
             bytes > limits::kLongRequestBytes) {
    at_.clients.reply_error(client, "too many long requests wait already: ask again later");
  } else {
    const std::uint64_t ticket = ++last_ticket_;
    long_requests_.emplace(ticket, LongRequest{client, frame.size()});
    at_.readers.read({ticket, std::string(frame), {}, 0, client.identity});
  }
}

void ClientsDesk::request_read(const ReadReport& report, Instant now) {
  if (report.point) {
    at_.traces.point_read(report.ticket, *report.point);
    return;
  }
  const auto found = long_requests_.find(report.ticket);
  if (found == long_requests_.end()) {
    return;
  }
  Client client = std::move(found->second.client);
  long_requests_.erase(found);
  client.request_id = report.read.request_id;
  answer(client, report.read, now);
}

/// Why the request is not answered, for a reason that does not lie in what is asked, or an empty
/// text.
std::string ClientsDesk::objection_to(const ReadRequest& read) {
  const protocol::ClientRequest& request = read.request;
  const WriteLedger& ledger = at_.sources.ledger;
  if (!read.is_readable) {
    at_.bad_frames.count("a client");
    return "the request cannot be read";
  }
  if (request.protocol_version() == 0) {
    at_.bad_frames.count("a client");
    return "this is the port for clients; workers connect to the other one";
  }
  if (std::string reason = protocol::objection_to_version(request.protocol_version(), "client");
      !reason.empty()) {
    return reason;
  }
  if ((request.has_submit() || request.has_change()) && ledger.takes_no_change()) {
    return "too many changes wait for the disk already: ask again later";
  }
  if ((request.has_submit() || request.has_change()) && ledger.is_slow()) {
    return fmt::format(
        "the change was not stored: the database stored nothing for over {} s. Its disk is slow or "
        "the file is damaged (`oblique check` examines it). Ask again later",
        WriteLedger::kSlowAfter_s);
  }
  return ledger.is_gone() && !request.has_status() && !request.has_workers() ? ledger.fault()
                                                                             : std::string();
}

void ClientsDesk::answer(const Client& client, const ReadRequest& read, Instant now) {
  if (const std::string reason = objection_to(read); !reason.empty()) {
    at_.clients.reply_error(client, reason);
    return;
  }
  const protocol::ClientRequest& request = read.request;
  if (!may_ask(client, request)) {
    return;
  }
  using Kind = protocol::ClientRequest;
  switch (request.kind_case()) {
    case Kind::kSubmit:
      submit(client, read, now);
      break;
    case Kind::kStatus:
      status(client, request.status(), now);
      break;
    case Kind::kWorkers:
      workers(client, request.workers(), now);
      break;
    case Kind::kChange:
      at_.changes.change(client, request.change(), now);
      break;
    case Kind::kQuery:
      queries_.ask(client, request.query(), now);
      break;
    case Kind::kDescribe:
      describe(client, request.describe());
      break;
    case Kind::kTrace:
      trace(client, request.trace(), now);
      break;
    case Kind::kMoreRows:
      queries_.more(client, request.more_rows());
      break;
    case Kind::kEndQuery:
      queries_.end(client.identity, request.end_query().request_id());
      at_.traces.end(client.identity, request.end_query().request_id());
      break;
    case Kind::KIND_NOT_SET:
      at_.bad_frames.count("a client");
      at_.clients.reply_error(client, "the server does not know this kind of request");
      break;
  }
}

/// Whether the role of the client's key allows the request; else it is told.
bool ClientsDesk::may_ask(const Client& client, const protocol::ClientRequest& request) {
  if (!client.is_reader() || !(request.has_submit() || request.has_change())) {
    return true;
  }
  at_.clients.reply_error(
      client, fmt::format("the key \"{}\" is a reader's: it may look at studies, workers and "
                          "results, and change nothing",
                          client.key()));
  return false;
}

void ClientsDesk::submit(const Client& client, const ReadRequest& read, Instant now) {
  if (stopping_) {
    at_.clients.reply_error(client, "the server is stopping: submit again when it is back");
  } else if (draining_) {
    at_.clients.reply_error(client,
                            "the server is draining, that is, it waits for results under way "
                            "and then stops: submit again when it is back");
  } else {
    at_.changes.submit(client, read, now);
  }
}

protocol::StudyStatus ClientsDesk::status_of(StudyId id, Instant now) const {
  const StudyView view = view_of(id, at_.sources, now);
  protocol::StudyStatus message = to_message(view);
  if (draining_ && view.state == StudyState::kRunning) {
    message.set_waits_for("the server, which is draining, to be started again");
  }
  return message;
}

void ClientsDesk::status(const Client& client, const protocol::StatusRequest& request,
                         Instant now) {
  protocol::ClientReply reply;
  reply.set_request_id(client.request_id);
  auto& fields = *reply.mutable_status();
  fields.set_draining(draining_);
  fields.set_workers(static_cast<std::uint32_t>(at_.sources.scheduler.workers()));
  fields.set_access(settings_.access);
  fields.set_version(settings_.version);
  fields.set_utc_ms(now.utc_ms);
  if (!request.study().empty() || request.study_id() != 0) {
    const StudyStates& states = at_.sources.states;
    auto known = states.find_durable(request.study());
    if (request.study_id() != 0) {
      const bool is_there =
          states.contains(request.study_id()) && states.is_durable(request.study_id());
      known = is_there ? std::optional(request.study_id()) : std::nullopt;
    }
    if (!known) {
      at_.clients.reply_error(client, unknown_study(request.study(), states));
      return;
    }
    *fields.add_studies() = status_of(*known, now);
    at_.clients.to_client(client.identity, reply);
    return;
  }
  const std::size_t most = page_size(request.limit(), limits::kPageLength);
  std::size_t bytes = 0;
  for (auto id = at_.sources.states.durable_after(request.after_study_id()); id;
       id = at_.sources.states.durable_after(*id)) {
    if (static_cast<std::size_t>(fields.studies_size()) == most || bytes > limits::kPageBytes) {
      fields.set_next_after(fields.studies(fields.studies_size() - 1).study_id());
      break;
    }
    *fields.add_studies() = status_of(*id, now);
    bytes += fields.studies(fields.studies_size() - 1).ByteSizeLong();
  }
  at_.clients.to_client(client.identity, reply);
}

/// The recipe goes out as it is kept.
void ClientsDesk::describe(const Client& client, const protocol::DescribeRequest& request) {
  const StudyStates& states = at_.sources.states;
  const auto known = states.find_durable(request.study());
  if (!known) {
    at_.clients.reply_error(client, unknown_study(request.study(), states));
    return;
  }
  const std::string& recipe = states.record(*known).table.recipe_bytes();
  at_.clients.forward_to_client(client.identity,
                                protocol::description_around(client.request_id, recipe));
}

void ClientsDesk::workers(const Client& client, const protocol::WorkersRequest& request,
                          Instant now) {
  protocol::ClientReply reply;
  reply.set_request_id(client.request_id);
  auto& fields = *reply.mutable_workers();
  fields.set_bad_frames(at_.bad_frames.total());
  fields.set_access(settings_.access);
  if (request.after_worker_id() == 0) {
    add_keys(fields);
  }
  const std::size_t most = page_size(request.limit(), limits::kPageLength);
  for (auto id = at_.workers.next_after(request.after_worker_id()); id;
       id = at_.workers.next_after(*id)) {
    if (static_cast<std::size_t>(fields.workers_size()) == most) {
      fields.set_next_after(fields.workers(fields.workers_size() - 1).worker_id());
      break;
    }
    *fields.add_workers() = to_message(
        view_of(*id, *at_.workers.find(*id), at_.sources.scheduler, at_.worker_rates, now));
  }
  at_.clients.to_client(client.identity, reply);
}

void ClientsDesk::trace(const Client& client, const protocol::TraceRequest& request, Instant now) {
  const auto known = at_.sources.states.find_durable(request.study());
  if (!known) {
    at_.clients.reply_error(client, unknown_study(request.study(), at_.sources.states));
    return;
  }
  const StudyRecord& study = at_.sources.states.record(*known);
  if (study.failures.contains(request.point()) && !request.only_point()) {
    at_.clients.reply_error(client, fmt::format("point {} of the study \"{}\" failed and has no "
                                                "trace: `oblique retry` solves it again",
                                                request.point(), study.name));
  } else {
    at_.traces.request(client, request, *known, study.table,
                       at_.sources.scheduler.study(*known).solver_version, now);
  }
}

/// Who was turned away, and which keys are connected.
void ClientsDesk::add_keys(protocol::WorkersReply& reply) const {
  const PeerCounts peers = at_.network.peer_counts();
  for (const auto& [reason, count] : peers.refusals) {
    auto& refusals = *reply.add_refusals();
    refusals.set_reason(reason);
    refusals.set_peers(count);
  }
  for (const auto& [name, connected] : peers.keys) {
    auto& key = *reply.add_keys();
    key.set_name(name);
    key.set_role(std::string(protocol::name_of(connected.role)));
    key.set_connections(connected.connections);
  }
}

void ClientsDesk::stop() {
  stopping_ = true;
  for (const auto& [ticket, request] : std::exchange(long_requests_, {})) {
    at_.clients.reply_error(request.client, "the server is stopping: ask again when it is back");
  }
  queries_.stop();
  at_.traces.stop();
}

}  // namespace oblique::server
