#include "server/service/study_changes.h"

#include <stdexcept>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/written/study_name.h"
#include "proto/recipe/written/study_terms.h"
#include "proto/text.h"

namespace oblique::server {
namespace {

constexpr std::size_t kLongestShownName = 200;

/// Why no study can have these terms, or an empty text.
std::string objection_to_terms(const StudyTerms& terms) {
  const std::string priority = protocol::objection_to_priority(terms.priority);
  return priority.empty() ? protocol::objection_to_weight(terms.weight) : priority;
}

/// What the request says of the terms, and for the rest what is.
StudyTerms asked_terms(const protocol::SubmitRequest& request, StudyTerms terms) {
  if (request.has_priority()) {
    terms.priority = request.priority();
  }
  if (request.has_weight() && request.weight() != 0.0) {
    terms.weight = request.weight();
  }
  if (request.has_mixes_versions()) {
    terms.mixes_versions = request.mixes_versions();
  }
  return terms;
}

}  // namespace

std::string unknown_study(const std::string& name) {
  return fmt::format("there is no study called \"{}\": `oblique studies` lists all",
                     protocol::shortened(name, kLongestShownName));
}

// ---- What is asked ----------------------------------------------------------------------------

void StudyChanges::submit(const Client& client, const ReadRequest& read, Instant now) {
  const protocol::SubmitRequest& request = read.request.submit();
  if (const std::string reason = protocol::objection_to_study_name(request.name());
      !reason.empty()) {
    clients_.reply_error(client, reason);
    return;
  }
  const auto known = states_.find(request.name());
  const StudyTerms terms =
      asked_terms(request, known ? states_.record(*known).terms : StudyTerms{});
  if (const std::string reason = objection_to_terms(terms); !reason.empty()) {
    clients_.reply_error(client, reason);
    return;
  }
  if (!read.objection.empty()) {
    clients_.reply_error(client, read.objection);
    return;
  }
  if (!known) {
    add(client, read, terms, now);
    return;
  }
  const StudyRecord& study = states_.record(*known);
  if (!study.table.is_of_the_recipe_of(read.table)) {
    clients_.reply_error(client, fmt::format("there is a study called \"{}\" with other points, "
                                             "another model or another choice of errors: "
                                             "give this one another name, or use another database",
                                             request.name()));
  } else if (states_.is_durable(*known) && !(study.terms == terms)) {
    ledger_.write(SetStudyTerms{*known, terms}, TermsWrite{*known, terms, client});
  } else {
    go_on(client, *known, now);
  }
}

void StudyChanges::add(const Client& client, const ReadRequest& read, const StudyTerms& terms,
                       Instant now) {
  if (!may_open(client, last_study_id_ + 1, client.key(), read.table.size())) {
    return;
  }
  const StudyId id = ++last_study_id_;
  const std::string& name = read.request.submit().name();
  const std::string created_at = iso_8601(now);
  states_.add(id, {name, read.table, created_at, terms, {}, {}, now.steady_ms, client.key()});
  recount(id);
  submitters_[id].push_back(client);
  ledger_.write(AddStudy{id, name, read.table, created_at, terms, client.key()}, StudyWrite{id});
}

/// Whether the study may have so many further points open; else the client is told why not.
bool StudyChanges::may_open(const Client& client, StudyId id, const std::string& key,
                            std::uint64_t points) {
  const std::string objection = open_.objection_to(id, key, points);
  if (objection.empty()) {
    return true;
  }
  open_.count_refusal(client.key());
  clients_.reply_error(client, objection);
  return false;
}

/// The same of a study that is to get another state.
bool StudyChanges::may_reopen(const Client& client, StudyId id, StudyState wanted) {
  return wanted != StudyState::kRunning || states_.is_open(id) ||
         may_open(client, id, states_.record(id).submitted_by, open_points_of(id, sources_));
}

void StudyChanges::recount(StudyId id) {
  if (states_.contains(id) && states_.is_open(id)) {
    open_.set(id, states_.record(id).submitted_by, open_points_of(id, sources_));
  } else {
    open_.close(id);
  }
}

/// Submitted again.
void StudyChanges::go_on(const Client& client, StudyId id, Instant now) {
  if (!states_.is_durable(id)) {
    submitters_[id].push_back(client);
  } else if (states_.needs_write(id, StudyState::kRunning)) {
    if (may_reopen(client, id, StudyState::kRunning)) {
      set_state(client, id, StudyState::kRunning, true, now);
    }
  } else {
    reply_submitted(client, id, false, now);
  }
}

void StudyChanges::change(const Client& client, const protocol::ChangeRequest& request,
                          Instant now) {
  const auto known = states_.find_durable(request.study());
  if (!known) {
    clients_.reply_error(client, unknown_study(request.study()));
    return;
  }
  StudyState wanted{};
  switch (request.change()) {
    case protocol::STUDY_CHANGE_CANCEL:
      wanted = StudyState::kCancelled;
      break;
    case protocol::STUDY_CHANGE_PAUSE:
      // A cancelled study rests already.
      wanted = states_.state(*known) == StudyState::kCancelled ? StudyState::kCancelled
                                                               : StudyState::kPaused;
      break;
    case protocol::STUDY_CHANGE_RESUME:
      wanted = StudyState::kRunning;
      break;
    case protocol::STUDY_CHANGE_RETRY:
      retry(client, *known, now);
      return;
    default:
      clients_.reply_error(client, "the server does not know this change of a study");
      return;
  }
  if (states_.needs_write(*known, wanted)) {
    if (may_reopen(client, *known, wanted)) {
      set_state(client, *known, wanted, false, now);
    }
  } else {
    reply_changed(client, *known, 0, now);
  }
}

void StudyChanges::set_state(const Client& client, StudyId id, StudyState state, bool submitted,
                             Instant now) {
  states_.change(id, state);
  recount(id);
  ledger_.write(SetStudyState{id, state, iso_8601(now)}, StateWrite{id, state, client, submitted});
}

void StudyChanges::retry(const Client& client, StudyId id, Instant now) {
  const StudyRecord& study = states_.record(id);
  if (study.failures.empty()) {
    reply_changed(client, id, 0, now);
    return;
  }
  try {
    (void)study.table.get();
  } catch (const std::runtime_error& error) {
    clients_.reply_error(client,
                         fmt::format("the recipe of the study cannot be read: {}", error.what()));
    return;
  }
  const bool stays_closed = states_.state(id) == StudyState::kCancelled;
  if (!stays_closed && !may_open(client, id, study.submitted_by, study.failures.size())) {
    return;
  }
  ledger_.write(ForgetFailures{id, study.failures, iso_8601(now)},
                FailuresWrite{id, study.failures, client});
}

// ---- What became of it ------------------------------------------------------------------------

Event StudyChanges::stored(const StudyWrite& write, Instant now) {
  states_.added(write.study, now.steady_ms);
  const StudyRecord& study = states_.record(write.study);
  note(write.study, fmt::format("of {} points begins", study.table.size()));
  return StudyAdded{write.study, study.table, {}, 0, false, false, study.terms};
}

Event StudyChanges::stored(const StateWrite& write, Instant /*now*/) {
  states_.changed(write.study, write.state);
  if (write.state == StudyState::kRunning) {
    note(write.study, "goes on");
    return StudyReopened{write.study};
  }
  note(write.study, fmt::format("is {}", state_name(write.state)));
  if (write.state == StudyState::kPaused) {
    return StudyPaused{write.study};
  }
  return StudyCancelled{write.study};
}

Event StudyChanges::stored(const TermsWrite& write, Instant /*now*/) {
  states_.set_terms(write.study, write.terms);
  return StudyTermsChanged{write.study, write.terms};
}

Event StudyChanges::stored(const FailuresWrite& write, Instant now) {
  states_.forget_failures(write.study, write.points, now.steady_ms);
  note(write.study, fmt::format("tries its failed points again: {}", write.points.size()));
  return FailuresForgotten{write.study, write.points, states_.record(write.study).attempts};
}

void StudyChanges::answer(const StudyWrite& write, Instant now) {
  recount(write.study);
  const auto waiting = submitters_.extract(write.study);
  bool created = true;
  for (const Client& client : waiting.mapped()) {
    reply_submitted(client, write.study, std::exchange(created, false), now);
  }
}

void StudyChanges::answer(const StateWrite& write, Instant now) {
  recount(write.study);
  if (write.submitted) {
    reply_submitted(write.client, write.study, false, now);
  } else {
    reply_changed(write.client, write.study, 0, now);
  }
}

void StudyChanges::answer(const TermsWrite& write, Instant now) {
  go_on(write.client, write.study, now);
}

void StudyChanges::answer(const FailuresWrite& write, Instant now) {
  recount(write.study);
  reply_changed(write.client, write.study, write.points.size(), now);
}

void StudyChanges::refused(const StudyWrite& write, const std::string& error) {
  states_.remove(write.study);
  recount(write.study);
  const auto waiting = submitters_.extract(write.study);
  for (const Client& client : waiting.mapped()) {
    clients_.reply_error(client, "the study was not stored: " + error);
  }
}

void StudyChanges::refused(const StateWrite& write, const std::string& error) {
  states_.refused(write.study);
  recount(write.study);
  reply_unchanged(write.client, error);
}

void StudyChanges::refused(const TermsWrite& write, const std::string& error) {
  reply_unchanged(write.client, error);
}

void StudyChanges::refused(const FailuresWrite& write, const std::string& error) {
  reply_unchanged(write.client, error);
}

// ---- Replies ----------------------------------------------------------------------------------

void StudyChanges::reply_submitted(const Client& client, StudyId id, bool created, Instant now) {
  const StudyView view = view_of(id, sources_, now);
  protocol::ClientReply reply;
  reply.set_request_id(client.request_id);
  auto& fields = *reply.mutable_submit();
  fields.set_study_id(id);
  fields.set_points(view.points);
  fields.set_settled(view.settled());
  fields.set_created(created);
  clients_.to_client(client.identity, reply);
}

void StudyChanges::reply_changed(const Client& client, StudyId id, std::uint64_t retried,
                                 Instant now) {
  protocol::ClientReply reply;
  reply.set_request_id(client.request_id);
  *reply.mutable_change()->mutable_study() = to_message(view_of(id, sources_, now));
  reply.mutable_change()->set_retried(retried);
  clients_.to_client(client.identity, reply);
}

void StudyChanges::reply_unchanged(const Client& client, const std::string& error) {
  clients_.reply_error(client, "the change was not stored, the study is as before: " + error);
}

void StudyChanges::note(StudyId id, const std::string& what) {
  log_.note(Severity::kInfo, fmt::format("study {} {}", states_.record(id).name, what));
}

}  // namespace oblique::server
