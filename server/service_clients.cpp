// The side of the service that speaks with clients.
#include <algorithm>
#include <utility>

#include "proto/frames.h"
#include "proto/study_name.h"
#include "server/service.h"

namespace oblique::server {
namespace {

constexpr std::size_t kLongestName = 200;
/// Number of no request: a reply with it is passed over by clients that do not know its kind.
constexpr std::uint64_t kNobodysRequest = UINT64_MAX;

/// Why studies cannot share the workers so, or an empty text.
std::string objection_to_share(const StudyShare& share) {
  constexpr std::int32_t kHighestPriority = 1000;
  constexpr double kLeastWeight = 0.001;
  constexpr double kLargestWeight = 1000.0;
  if (share.priority < -kHighestPriority || share.priority > kHighestPriority) {
    return "priority = " + std::to_string(share.priority) + " is not allowed: -1000 to 1000 is";
  }
  if (!(share.weight >= kLeastWeight && share.weight <= kLargestWeight)) {
    return "weight = " + std::to_string(share.weight) + " is not allowed: 0.001 to 1000 is";
  }
  return {};
}

/// What the request says of the share, and for the rest what is.
StudyShare asked_share(const protocol::SubmitRequest& request, StudyShare share) {
  if (request.has_priority()) {
    share.priority = request.priority();
  }
  if (request.has_weight() && request.weight() != 0.0) {
    share.weight = request.weight();
  }
  if (request.has_mixes_versions()) {
    share.mixes_versions = request.mixes_versions();
  }
  return share;
}

std::string unknown_study(const std::string& name) {
  return "there is no study called \"" + shortened(name, kLongestName) +
         "\": `oblique studies` lists all";
}

}  // namespace

void Service::client_frame(const std::string& identity, std::string_view frame, Instant now) {
  protocol::ClientRequest request;
  using Kind = protocol::ClientRequest;
  if (!protocol::decode(frame, request)) {
    bad_frame("a client");
    reply_error({identity, 0}, "the request cannot be read");
    return;
  }
  const Client client{identity, request.request_id()};
  if (request.protocol_version() == 0) {
    bad_frame("a client");
    reply_error(client, "this is the port for clients; workers connect to the other one");
    return;
  }
  if (const std::string reason =
          protocol::objection_to_version(request.protocol_version(), "client");
      !reason.empty()) {
    reply_error(client, reason);
    return;
  }
  if ((request.has_submit() || request.has_change()) &&
      waiting_changes_ >= settings_.most_waiting_changes) {
    reply_error(client, "too many changes wait for the disk already: ask again later");
    return;
  }
  if (storage_is_gone_ && !request.has_status() && !request.has_workers()) {
    reply_error(client, storage_fault_);
    return;
  }
  switch (request.kind_case()) {
    case Kind::kSubmit:
      submit(client, request.submit(), now);
      break;
    case Kind::kStatus:
      status(client, request.status(), now);
      break;
    case Kind::kWorkers:
      workers(client, now);
      break;
    case Kind::kChange:
      change(client, request.change(), now);
      break;
    case Kind::kQuery:
      query(client, request.query(), now);
      break;
    case Kind::KIND_NOT_SET:
      bad_frame("a client");
      reply_error(client, "the server does not know this kind of request");
      break;
  }
}

void Service::submit(const Client& client, const protocol::SubmitRequest& request, Instant now) {
  if (stopping_) {
    reply_error(client, "the server is stopping: submit again when it is back");
    return;
  }
  if (const std::string reason = protocol::objection_to_study_name(request.name());
      !reason.empty()) {
    reply_error(client, reason);
    return;
  }
  const auto known = study_ids_.find(request.name());
  const StudyShare share = asked_share(
      request, known == study_ids_.end() ? StudyShare{} : studies_.at(known->second).share);
  if (const std::string reason = objection_to_share(share); !reason.empty()) {
    reply_error(client, reason);
    return;
  }
  std::shared_ptr<const protocol::PointTable> table;
  try {
    table = std::make_shared<const protocol::PointTable>(request.recipe());
  } catch (const solver::InputError& error) {
    reply_error(client, error.what());
    return;
  }
  if (known != study_ids_.end()) {
    const Study& study = studies_.at(known->second);
    if (study.table->recipe().SerializeAsString() != table->recipe().SerializeAsString()) {
      reply_error(client, "there is a study called \"" + request.name() +
                              "\" with other points or another model: give this one another name, "
                              "or use another database");
      return;
    }
    if (study.durable && !(study.share == share)) {
      write(SetStudyShare{known->second, share}, OfShare{known->second, share, client}, true);
    } else {
      continue_study(client, known->second, now);
    }
    return;
  }
  const StudyId id = ++settings_.last_study_id;
  const std::string created_at = iso_8601(now);
  study_ids_.emplace(request.name(), id);
  studies_.emplace(id, Study{request.name(),
                             table,
                             StudyState::kRunning,
                             created_at,
                             share,
                             {},
                             {},
                             false,
                             0,
                             false,
                             {client},
                             {}});
  write(AddStudy{id, request.name(), table, created_at, share}, OfStudy{id}, true);
}

void Service::continue_study(const Client& client, StudyId id, Instant now) {
  Study& study = studies_.at(id);
  const bool rests = study.state == StudyState::kCancelled || study.state == StudyState::kPaused;
  if (!study.durable) {
    study.submitters.push_back(client);
  } else if (rests ||
             ((study.state_writes > 0 || study.is_doubtful) && study.state != StudyState::kDone)) {
    set_state(client, id, StudyState::kRunning, true, now);
  } else {
    reply_submitted(client, id, false);
  }
}

void Service::set_state(const Client& client, StudyId id, StudyState state, bool submitted,
                        Instant now) {
  Study& study = studies_.at(id);
  const StudyState before = study.state;
  study.state = state;
  ++study.state_writes;
  write(SetStudyState{id, state, iso_8601(now)}, OfState{id, before, state, client, submitted},
        true);
}

void Service::change(const Client& client, const protocol::ChangeRequest& request, Instant now) {
  const auto known = study_ids_.find(request.study());
  if (known == study_ids_.end() || !studies_.at(known->second).durable) {
    reply_error(client, unknown_study(request.study()));
    return;
  }
  const StudyId id = known->second;
  const Study& study = studies_.at(id);
  StudyState wanted{};
  switch (request.change()) {
    case protocol::STUDY_CHANGE_CANCEL:
      wanted = StudyState::kCancelled;
      break;
    case protocol::STUDY_CHANGE_PAUSE:
      // A cancelled study rests already.
      wanted = study.state == StudyState::kCancelled ? study.state : StudyState::kPaused;
      break;
    case protocol::STUDY_CHANGE_RESUME:
      wanted = StudyState::kRunning;
      break;
    case protocol::STUDY_CHANGE_RETRY:
      retry(client, id, now);
      return;
    default:
      reply_error(client, "the server does not know this change of a study");
      return;
  }
  if (study.state == StudyState::kDone ||
      (study.state == wanted && study.state_writes == 0 && !study.is_doubtful)) {
    reply_changed(client, id, 0, now);
    return;
  }
  set_state(client, id, wanted, false, now);
}

void Service::retry(const Client& client, StudyId id, Instant now) {
  const IntervalSet& failures = studies_.at(id).failures;
  if (failures.empty()) {
    reply_changed(client, id, 0, now);
    return;
  }
  write(ForgetFailures{id, failures, iso_8601(now)}, OfFailures{id, failures, client}, true);
}

void Service::status(const Client& client, const protocol::StatusRequest& request, Instant now) {
  protocol::ClientReply reply;
  reply.set_request_id(client.request_id);
  auto& fields = *reply.mutable_status();
  fields.set_workers(static_cast<std::uint32_t>(scheduler_.workers()));
  for (const auto& [id, study] : studies_) {
    if (study.durable && (request.study().empty() || request.study() == study.name)) {
      *fields.add_studies() = status_of(id, now);
    }
  }
  if (!request.study().empty() && fields.studies().empty()) {
    reply_error(client, unknown_study(request.study()));
    return;
  }
  outbox_.to_client(client.identity, reply);
}

protocol::StudyStatus Service::status_of(StudyId id, Instant now) const {
  const Study& study = studies_.at(id);
  const StudyCounts counts = scheduler_.study(id);
  const std::uint64_t settled = counts.solved + counts.failed;
  protocol::StudyStatus status;
  status.set_study_id(id);
  status.set_name(study.name);
  status.set_state(settled == counts.points ? "done" : state_name(study.state));
  status.set_points(counts.points);
  status.set_solved(counts.solved);
  status.set_failed(counts.failed);
  status.set_leased(counts.leased);
  status.set_created_at(study.created_at);
  status.set_priority(study.share.priority);
  status.set_weight(study.share.weight);
  status.set_mixes_versions(study.share.mixes_versions);
  status.set_solver_version(counts.solver_version);
  status.set_waits_for(what_it_waits_for(study, counts));
  if (study.state == StudyState::kRunning && !study.samples.empty()) {
    const Sample& oldest = study.samples.front();
    const std::int64_t span_ms = now.steady_ms - oldest.steady_ms;
    if (span_ms > 0) {
      status.set_points_per_s(1000.0 *
                              (static_cast<double>(settled) - static_cast<double>(oldest.settled)) /
                              static_cast<double>(span_ms));
    }
  }
  return status;
}

std::string Service::what_it_waits_for(const Study& study, const StudyCounts& counts) const {
  if (study.state != StudyState::kRunning || counts.solved + counts.failed == counts.points) {
    return {};
  }
  if (!storage_fault_.empty()) {
    return storage_is_gone_ ? storage_fault_
                            : "the database, which takes no results: " + storage_fault_;
  }
  if (scheduler_.workers() == 0) {
    return "a worker";
  }
  if (counts.lacks_worker) {
    return "a worker with solver version " + counts.solver_version +
           ", that of its results, or to be submitted again with --mix-versions";
  }
  return {};
}

void Service::workers(const Client& client, Instant now) {
  protocol::ClientReply reply;
  reply.set_request_id(client.request_id);
  auto& fields = *reply.mutable_workers();
  fields.set_bad_frames(bad_frames_);
  for (const auto& [id, peer] : peers_) {
    const WorkerCounts counts = scheduler_.worker(id, now.steady_ms);
    auto& worker = *fields.add_workers();
    worker.set_worker_id(id);
    worker.set_name(peer.name);
    worker.set_threads(peer.threads);
    worker.set_instruction_set(peer.instruction_set);
    worker.set_solver_version(peer.solver_version);
    worker.set_leased_points(counts.leased_points);
    worker.set_solved_points(counts.solved_points);
    worker.set_silent_ms(static_cast<std::uint32_t>(counts.silent_ms));
    worker.set_losses(counts.losses);
    worker.set_set_aside(counts.is_set_aside);
    worker.set_proven(counts.is_proven);
  }
  outbox_.to_client(client.identity, reply);
}

void Service::query(const Client& client, const protocol::QueryRequest& request, Instant now) {
  const bool is_known = std::any_of(queries_.begin(), queries_.end(), [&](const auto& entry) {
    return entry.second.client.identity == client.identity &&
           entry.second.client.request_id == client.request_id;
  });
  if (is_known) {
    return;  // asked again; the answer is on its way
  }
  const std::uint64_t ticket = ++last_ticket_;
  if (stopping_ || !outbox_.query({ticket, client.identity, request})) {
    reply_error(client, stopping_ ? "the server is stopping: ask again when it runs"
                                  : "too many queries wait already: ask again later");
    return;
  }
  queries_.emplace(ticket, Query{client, now.steady_ms + settings_.still_working_every_ms});
}

void Service::queried(QueryReport report) {
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
  outbox_.forward_to_client(client.identity,
                            protocol::with_request_id(client.request_id, report.reply));
}

void Service::tell_of_queries(Instant now) {
  std::vector<std::uint64_t> abandoned;
  for (auto& [ticket, query] : queries_) {
    if (now.steady_ms < query.next_word_ms) {
      continue;
    }
    query.next_word_ms = now.steady_ms + settings_.still_working_every_ms;
    protocol::ClientReply word;
    word.set_request_id(kNobodysRequest);
    word.mutable_still_working()->set_request_id(query.client.request_id);
    word.mutable_still_working()->set_runs(query.runs);
    if (!outbox_.to_client(query.client.identity, word)) {
      abandoned.push_back(ticket);
    }
  }
  for (const std::uint64_t ticket : abandoned) {
    outbox_.cancel_query(ticket);
    queries_.erase(ticket);
  }
}

// ---- Replies ----------------------------------------------------------------------------------

void Service::reply_submitted(const Client& client, StudyId id, bool created) {
  const StudyCounts counts = scheduler_.study(id);
  protocol::ClientReply reply;
  reply.set_request_id(client.request_id);
  auto& fields = *reply.mutable_submit();
  fields.set_study_id(id);
  fields.set_points(counts.points);
  fields.set_settled(counts.solved + counts.failed);
  fields.set_created(created);
  outbox_.to_client(client.identity, reply);
}

void Service::reply_changed(const Client& client, StudyId id, std::uint64_t retried, Instant now) {
  protocol::ClientReply reply;
  reply.set_request_id(client.request_id);
  *reply.mutable_change()->mutable_study() = status_of(id, now);
  reply.mutable_change()->set_retried(retried);
  outbox_.to_client(client.identity, reply);
}

void Service::reply_error(const Client& client, const std::string& message) {
  protocol::ClientReply reply;
  reply.set_request_id(client.request_id);
  reply.mutable_error()->set_message(message);
  outbox_.to_client(client.identity, reply);
}

}  // namespace oblique::server
