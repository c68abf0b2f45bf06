// The side of the service that speaks with clients.
#include <algorithm>
#include <utility>

#include "proto/frame_scan.h"
#include "proto/frames.h"
#include "proto/recipe/study_name.h"
#include "proto/text.h"
#include "server/service/service.h"

namespace oblique::server {
namespace {

constexpr std::size_t kLongestNameShown = 200;
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

}  // namespace

std::string unknown_study(const std::string& name) {
  return "there is no study called \"" + protocol::shortened(name, kLongestNameShown) +
         "\": `oblique studies` lists all";
}

void Service::client_frame(const std::string& identity, std::string_view frame, Instant now) {
  if (frame.size() > settings_.longest_inline_bytes) {
    read_elsewhere(identity, frame);
    return;
  }
  take(identity, read_request(frame), now);
}

/// Of one client few wait, so that the others find room.
void Service::read_elsewhere(const std::string& identity, std::string_view frame) {
  const Client client{identity, protocol::request_id_of(frame)};
  std::size_t bytes = frame.size();
  std::size_t of_client = 0;
  for (const auto& [ticket, request] : long_requests_) {
    if (client.request_id != 0 && request.client == client) {
      return;  // it is sent again because the answer takes long; it waits already
    }
    bytes += request.bytes;
    of_client += request.client.identity == identity ? 1U : 0U;
  }
  if (stopping_) {
    reply_error(client, "the server is stopping: ask again when it is back");
  } else if (long_requests_.size() >= settings_.most_long_requests ||
             of_client >= settings_.most_long_requests_of_one ||
             bytes > settings_.most_long_bytes) {
    reply_error(client, "too many long requests wait already: ask again later");
  } else {
    const std::uint64_t ticket = ++last_ticket_;
    long_requests_.emplace(ticket, LongRequest{client, frame.size()});
    outbox_.read({ticket, std::string(frame)});
  }
}

void Service::request_read(ReadReport report, Instant now) {
  const auto found = long_requests_.find(report.ticket);
  if (found == long_requests_.end()) {
    return;
  }
  const std::string identity = found->second.client.identity;
  long_requests_.erase(found);
  take(identity, report.read, now);
}

void Service::take(const std::string& identity, const ReadRequest& read, Instant now) {
  const Client client{identity, read.request_id};
  const protocol::ClientRequest& request = read.request;
  using Kind = protocol::ClientRequest;
  if (!read.is_readable) {
    bad_frame("a client");
    reply_error(client, "the request cannot be read");
    return;
  }
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
      submit(client, read, now);
      break;
    case Kind::kStatus:
      status(client, request.status(), now);
      break;
    case Kind::kWorkers:
      workers(client, request.workers(), now);
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

void Service::submit(const Client& client, const ReadRequest& read, Instant now) {
  const protocol::SubmitRequest& request = read.request.submit();
  if (stopping_) {
    reply_error(client, "the server is stopping: submit again when it is back");
    return;
  }
  if (const std::string reason = protocol::objection_to_study_name(request.name());
      !reason.empty()) {
    reply_error(client, reason);
    return;
  }
  const auto known = studies_.find(request.name());
  const StudyShare share =
      asked_share(request, known ? studies_.record(*known).share : StudyShare{});
  if (const std::string reason = objection_to_share(share); !reason.empty()) {
    reply_error(client, reason);
    return;
  }
  if (!read.objection.empty()) {
    reply_error(client, read.objection);
    return;
  }
  if (known) {
    const StudyRecord& study = studies_.record(*known);
    if (study.table.recipe_bytes() != read.table.recipe_bytes()) {
      reply_error(client, "there is a study called \"" + request.name() +
                              "\" with other points or another model: give this one another name, "
                              "or use another database");
      return;
    }
    if (studies_.is_durable(*known) && !(study.share == share)) {
      write(SetStudyShare{*known, share}, OfShare{*known, share, client}, true);
    } else {
      continue_study(client, *known, now);
    }
    return;
  }
  const StudyId id = ++settings_.last_study_id;
  const std::string created_at = iso_8601(now);
  studies_.add(id, {request.name(), read.table, created_at, share, {}, {}, now.steady_ms});
  submitters_[id].push_back(client);
  write(AddStudy{id, request.name(), read.table, created_at, share}, OfStudy{id}, true);
}

void Service::continue_study(const Client& client, StudyId id, Instant now) {
  if (!studies_.is_durable(id)) {
    submitters_[id].push_back(client);
  } else if (studies_.needs_write(id, StudyState::kRunning)) {
    set_state(client, id, StudyState::kRunning, true, now);
  } else {
    reply_submitted(client, id, false);
  }
}

void Service::set_state(const Client& client, StudyId id, StudyState state, bool submitted,
                        Instant now) {
  studies_.change(id, state);
  write(SetStudyState{id, state, iso_8601(now)}, OfState{id, state, client, submitted}, true);
}

void Service::change(const Client& client, const protocol::ChangeRequest& request, Instant now) {
  const auto known = studies_.find_durable(request.study());
  if (!known) {
    reply_error(client, unknown_study(request.study()));
    return;
  }
  const StudyId id = *known;
  StudyState wanted{};
  switch (request.change()) {
    case protocol::STUDY_CHANGE_CANCEL:
      wanted = StudyState::kCancelled;
      break;
    case protocol::STUDY_CHANGE_PAUSE:
      // A cancelled study rests already.
      wanted = studies_.state(id) == StudyState::kCancelled ? StudyState::kCancelled
                                                            : StudyState::kPaused;
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
  if (!studies_.needs_write(id, wanted)) {
    reply_changed(client, id, 0, now);
    return;
  }
  set_state(client, id, wanted, false, now);
}

void Service::retry(const Client& client, StudyId id, Instant now) {
  const IntervalSet& failures = studies_.record(id).failures;
  if (failures.empty()) {
    reply_changed(client, id, 0, now);
    return;
  }
  try {
    (void)studies_.record(id).table.get();
  } catch (const std::runtime_error& error) {
    reply_error(client, "the recipe of the study cannot be read: " + std::string(error.what()));
    return;
  }
  write(ForgetFailures{id, failures, iso_8601(now)}, OfFailures{id, failures, client}, true);
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
