#include "server/service/study_changes.h"

#include <stdexcept>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/written/study_name.h"
#include "proto/recipe/written/study_priority.h"
#include "proto/text.h"

namespace oblique::server {
namespace {

constexpr std::size_t kLongestShownName = 200;
/// Of one study, for a change of it to be durable.
constexpr std::size_t kMostWaiting = 1000;

}  // namespace

std::string unknown_study(const std::string& name, const StudyStates& states) {
  const std::string nearest = states.nearest(name);
  if (!name.empty() && nearest == name) {  // who asked gave a number, too
    return fmt::format(
        "the study that is called \"{}\" is another one than was asked for: `oblique "
        "studies` lists all",
        protocol::shortened(name, kLongestShownName));
  }
  return fmt::format("there is no study called \"{}\"{}: `oblique studies` lists all",
                     protocol::shortened(name, kLongestShownName),
                     nearest.empty() ? "" : fmt::format(" (did you mean `{}`?)", nearest));
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
  const std::int32_t priority = request.has_priority() ? request.priority()
                                : known                ? states_.record(*known).priority
                                                       : 0;
  if (const std::string reason = protocol::objection_to_priority(priority); !reason.empty()) {
    clients_.reply_error(client, reason);
    return;
  }
  if (!read.objection.empty()) {
    clients_.reply_error(client, read.objection);
    return;
  }
  if (!known) {
    add(client, read, priority, now);
    return;
  }
  if (const auto turn = turns_.find(*known); turn != turns_.end() &&
                                             !turn->second.submitters.empty() &&
                                             turn->second.grown.is_of_the_recipe_of(read.table)) {
    turn->second.submitters.push_back(client);
    return;
  }
  if (waits(client, *known, [this, client, read](Instant then) { submit(client, read, then); })) {
    return;
  }
  const StudyRecord& study = states_.record(*known);
  if (!study.table.is_of_the_recipe_of(read.table)) {
    grow(client, *known, read, priority, now);
  } else if (states_.is_durable(*known) && study.priority != priority) {
    turns_[*known];
    ledger_.write(SetPriority{*known, priority}, PriorityWrite{*known, priority, client});
  } else {
    go_on(client, *known, now);
  }
}

/// The recipe is not that of the study: the study grows by what it has more, or it is refused.
void StudyChanges::grow(const Client& client, StudyId id, const ReadRequest& read,
                        std::int32_t priority, Instant now) {
  const StudyRecord& study = states_.record(id);
  Growth growth{Growth::Kind::kOther, "the stored one cannot be read"};
  bool has_more = false;
  try {
    growth = study.table.growth_to(read.table);
    has_more = read.table.size() > study.table.size();
  } catch (const std::runtime_error&) {
    // Only another version can.
  }
  if (growth.kind != Growth::Kind::kLonger || !has_more) {
    refuse_recipe(client, study.name, growth);
    return;
  }
  if (!states_.is_durable(id)) {
    turns_[id].later.emplace_back(
        [this, client, read](Instant then) { submit(client, read, then); });
    return;
  }
  const std::uint64_t appended = read.table.size() - study.table.size();
  if (!may_open(client, id, open_points_of(id, sources_) + appended)) {
    return;
  }
  const StudyView view = view_of(id, sources_, now);
  const bool reuses =
      !read.request.submit().no_reuse() && known_.should_seek(id, view.solver_version);
  const GrowthWrite write{id, read.table, priority, study.table.size(), view.state, reuses};
  Turn& turn = turns_[id];
  turn.grown = read.table;
  turn.submitters.push_back(client);
  states_.change(id, StudyState::kRunning);
  recount(id);
  ledger_.write(GrowStudy{id, read.table, priority, iso_8601(now), reuses}, write);
}

void StudyChanges::refuse_recipe(const Client& client, const std::string& name,
                                 const Growth& growth) {
  const bool is_shorter = growth.kind == Growth::Kind::kShorter;
  clients_.reply_error(
      client, fmt::format("there is a study called \"{}\" with {}. A study may grow by blocks "
                          "behind those that it has, and never change:\n{}\n"
                          "Give this one another name, or use another database",
                          name, is_shorter ? "more points" : "another recipe", growth.difference));
}

/// Whether the request waits until the change of the study that is on its way is durable or
/// refused; it is asked again then.
bool StudyChanges::waits(const Client& client, StudyId id, std::function<void(Instant)> later) {
  const auto turn = turns_.find(id);
  if (turn == turns_.end()) {
    return false;
  }
  if (turn->second.later.size() >= kMostWaiting) {
    clients_.reply_error(client, "too many changes of that study wait already: ask again later");
  } else {
    turn->second.later.push_back(std::move(later));
  }
  return true;
}

void StudyChanges::end_turn(StudyId id, Instant now) {
  const auto turn = turns_.extract(id);
  if (turn) {
    for (const auto& later : turn.mapped().later) {
      later(now);
    }
  }
}

bool StudyChanges::puts_off_end(StudyId id) {
  const auto turn = turns_.find(id);
  if (turn == turns_.end() || turn->second.submitters.empty()) {
    return false;
  }
  turn->second.end_is_put_off = true;
  return true;
}

bool StudyChanges::takes_end(StudyId id) {
  return ends_put_off_.erase(id) != 0;
}

void StudyChanges::add(const Client& client, const ReadRequest& read, std::int32_t priority,
                       Instant now) {
  if (!may_open(client, last_study_id_ + 1, read.table.size())) {
    return;
  }
  const StudyId id = ++last_study_id_;
  const std::string& name = read.request.submit().name();
  const std::string created_at = iso_8601(now);
  states_.add(id, {name, read.table, created_at, priority, {}, {}, now.steady_ms, client.key()});
  recount(id);
  submitters_[id].push_back(client);
  const bool reuses = !read.request.submit().no_reuse() && known_.should_seek(id, {});
  ledger_.write(AddStudy{id, name, read.table, created_at, priority, client.key(), reuses},
                StudyWrite{id, reuses});
}

/// Whether the study may be open with so many open points; else the client is told why not.
bool StudyChanges::may_open(const Client& client, StudyId id, std::uint64_t points) {
  const std::string objection = open_.objection_to(id, points);
  if (!objection.empty()) {
    clients_.reply_error(client, objection);
  }
  return objection.empty();
}

/// The same of a study that is to get another state.
bool StudyChanges::may_reopen(const Client& client, StudyId id, StudyState wanted) {
  return wanted != StudyState::kRunning || states_.is_open(id) ||
         may_open(client, id, open_points_of(id, sources_));
}

void StudyChanges::recount(StudyId id) {
  if (states_.contains(id) && states_.is_open(id)) {
    open_.set(id, open_points_of(id, sources_));
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
  std::optional<StudyId> known = states_.find_durable(request.study());
  if (request.study_id() != 0) {
    known = states_.contains(request.study_id()) && states_.is_durable(request.study_id())
                ? std::optional(request.study_id())
                : std::nullopt;
  }
  if (!known) {
    reply_gone(client, request);
  } else if (!waits(client, *known,
                    [this, client, request](Instant then) { change(client, request, then); })) {
    change_one(client, request, *known, now);
  }
}

/// There is no study of that name or number. One that was deleted before is deleted.
void StudyChanges::reply_gone(const Client& client, const protocol::ChangeRequest& request) {
  if (request.change() != protocol::STUDY_CHANGE_DELETE || request.study_id() == 0 ||
      request.study_id() > last_study_id_) {
    clients_.reply_error(client, unknown_study(request.study(), states_));
    return;
  }
  protocol::ClientReply reply;
  reply.set_request_id(client.request_id);
  auto& status = *reply.mutable_change()->mutable_study();
  status.set_study_id(request.study_id());
  status.set_name(request.study());
  status.set_state(kDeletedState);
  clients_.to_client(client.identity, reply);
}

void StudyChanges::change_one(const Client& client, const protocol::ChangeRequest& request,
                              StudyId id, Instant now) {
  const std::optional known(id);
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
    case protocol::STUDY_CHANGE_RENAME:
      rename(client, request, id, now);
      return;
    case protocol::STUDY_CHANGE_DELETE:
      remove(client, id);
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

void StudyChanges::rename(const Client& client, const protocol::ChangeRequest& request, StudyId id,
                          Instant now) {
  const std::string& name = request.new_name();
  if (const std::string reason = protocol::objection_to_study_name(name); !reason.empty()) {
    clients_.reply_error(client, reason);
    return;
  }
  const auto taken = states_.find(name);
  if (taken == id) {
    reply_changed(client, id, 0, now);
    return;
  }
  if (taken) {
    if (!waits(client, *taken,
               [this, client, request](Instant then) { change(client, request, then); })) {
      clients_.reply_error(
          client, fmt::format("there is a study called \"{}\" already: choose another name", name));
    }
    return;
  }
  states_.reserve(id, name);
  turns_[id];
  ledger_.write(RenameStudy{id, name}, NameWrite{id, name, client});
}

void StudyChanges::remove(const Client& client, StudyId id) {
  turns_[id];
  ledger_.write(DeleteStudy{id}, RemovalWrite{id, client});
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
  if (!stays_closed &&
      !may_open(client, id, open_points_of(id, sources_) + study.failures.size())) {
    return;
  }
  ledger_.write(ForgetFailures{id, study.failures, iso_8601(now)},
                FailuresWrite{id, study.failures, client});
}

}  // namespace oblique::server
