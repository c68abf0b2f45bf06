#include "server/service/study_changes.h"

#include <memory>
#include <stdexcept>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "proto/recipe/model_message.h"
#include "proto/text.h"
#include "proto/wire/frame_scan.h"

namespace oblique::server {
namespace {

constexpr std::size_t kLongestShownName = 200;
constexpr const char* kDeletedState = "deleted";

}  // namespace

std::string unknown_study(const std::string& name, const StudyStates& states) {
  const std::string nearest = states.nearest(name);
  const std::string shown = protocol::shortened(name, kLongestShownName);
  if (!name.empty() && nearest == name) {  // the request's study number does not match the name
    return fmt::format("study name \"{}\" and study number do not match: see `oblique studies`",
                       shown);
  }
  return fmt::format("there is no study called \"{}\"{}: see `oblique studies`", shown,
                     nearest.empty() ? "" : fmt::format(" (did you mean `{}`?)", nearest));
}

// ---- Reading -----------------------------------------------------------------------------------

ReadRequest read_request(std::string_view frame, bool validates_points) {
  ReadRequest read;
  read.is_readable = protocol::is_request_within_limits(frame) &&
                     protocol::decode(frame, read.request) &&
                     (frame.size() <= limits::kLongestInlineRequest || read.request.has_submit() ||
                      read.request.has_query());
  read.request.DiscardUnknownFields();
  read.request_id = read.is_readable ? read.request.request_id() : protocol::request_id_of(frame);
  if (!read.is_readable || !read.request.has_submit()) {
    return read;
  }
  try {
    protocol::Recipe& recipe = *read.request.mutable_submit()->mutable_recipe();
    protocol::check_size(recipe);
    auto table = std::make_shared<const protocol::PointTable>(std::move(recipe));
    read.needs_point_validation = table->has_points_to_validate() && !validates_points;
    if (validates_points) {
      table->validate_points();
    }
    read.table = std::move(table);
  } catch (const solver::InputError& error) {
    read.recipe_error = error.what();
  }
  read.request.mutable_submit()->clear_recipe();
  return read;
}

// ---- Writing -----------------------------------------------------------------------------------

/// Writes the change. If the database refuses it, calls `on_refused` and sends the client an error.
void StudyChanges::write(const Client& client, StudyId id, Change change, OnStored on_stored,
                         std::function<void()> on_refused) {
  pending_[id];
  const auto run_deferred = [](const Pending& ended, Instant now) {
    for (const auto& request : ended.deferred) {
      request(now);
    }
  };
  core_.ledger.write(
      std::move(change),
      [this, id, run_deferred, on_stored = std::move(on_stored)](Instant now) {
        const auto ended = pending_.extract(id);
        on_stored(now);
        run_deferred(ended.mapped(), now);
      },
      [this, client, id, run_deferred, on_refused = std::move(on_refused)](const std::string& error,
                                                                           Instant now) {
        const auto ended = pending_.extract(id);
        on_refused();
        const bool is_kept = core_.states.contains(id);
        core_.ports.reply_error(client,
                                (is_kept ? "the change was not stored and the study is unchanged: "
                                         : "the study was not stored: ") +
                                    error);
        if (is_kept) {
          core_.states.record(id).is_doubtful = true;
        }
        if (ended.mapped().is_complete) {
          finish(id, now);
        }
        run_deferred(ended.mapped(), now);
      });
}

/// If a change of the study is being written, stores `request` for later or refuses it, and returns
/// true.
bool StudyChanges::defers(const Client& client, StudyId id, std::function<void(Instant)> request) {
  const auto pending = pending_.find(id);
  if (pending == pending_.end()) {
    return false;
  }
  if (pending->second.deferred.size() >= limits::kDeferredRequests) {
    core_.ports.reply_error(client, "too many changes of that study are waiting: try again later");
  } else {
    pending->second.deferred.push_back(std::move(request));
  }
  return true;
}

// ---- Submit ------------------------------------------------------------------------------------

void StudyChanges::submit(const Client& client, const ReadRequest& read, Instant now) {
  const protocol::SubmitRequest& request = read.request.submit();
  const auto known = core_.states.find(request.name());
  const std::int32_t priority = request.has_priority() ? request.priority()
                                : known                ? core_.states.record(*known).priority
                                                       : 0;
  for (const std::string& reason : {protocol::study_name_error(request.name()),
                                    protocol::priority_error(priority), read.recipe_error}) {
    if (!reason.empty()) {
      core_.ports.reply_error(client, reason, protocol::ERROR_CODE_WRONG_REQUEST);
      return;
    }
  }
  if (!known) {
    add(client, read, priority, now);
    return;
  }
  if (defers(client, *known, [this, client, read](Instant then) { submit(client, read, then); })) {
    return;
  }
  const StudyRecord& study = core_.states.record(*known);
  Growth growth{Growth::Kind::kOther, "the stored recipe cannot be read"};
  try {
    growth = study.table.growth_to(read.table);
  } catch (const std::runtime_error&) {
    // A recipe that another version of the server has stored may be unreadable.
  }
  if (growth.kind != Growth::Kind::kSame) {
    grow(client, *known, read, growth, priority, now);
  } else if (study.priority != priority) {
    set_priority(client, *known, priority);
  } else {
    change_state(client, *known, StudyState::kRunning, submitted_reply(client, *known), now);
  }
}

void StudyChanges::add(const Client& client, const ReadRequest& read, std::int32_t priority,
                       Instant now) {
  if (!may_open(client, 1, read.table.size())) {
    return;
  }
  const StudyId id = ++last_study_id_;
  const std::string& name = read.request.submit().name();
  const std::string created_at = iso_8601(now);
  const bool reuses = should_look_up(read, {});
  const std::string uid = protocol::random_id();
  core_.states.add(id,
                   {name, read.table, created_at, priority, {}, now.steady_ms, client.key(), uid});
  const auto on_stored = [this, client, id, reuses](Instant then) {
    StudyRecord& study = core_.states.record(id);
    study.is_durable = true;
    study.since_ms = then.steady_ms;
    log(id, fmt::format("starts with {} points", study.table.size()));
    StudyAdded event{id, study.table, {}, 0, false, false, study.priority};
    event.held = reuses;
    core_.feed(event, then);
    if (reuses) {
      look_up(id, then);
    }
    protocol::SubmitReply reply;
    reply.set_created(true);
    reply_submitted(client, id, std::move(reply), then);
  };
  write(client, id, AddStudy{id, name, read.table, created_at, priority, client.key(), reuses, uid},
        on_stored, [this, id] { core_.states.remove(id); });
}

/// Handles a submitted recipe that differs from the stored one: appends its new points or refuses
/// it.
void StudyChanges::grow(const Client& client, StudyId id, const ReadRequest& read,
                        const Growth& growth, std::int32_t priority, Instant now) {
  const StudyRecord& study = core_.states.record(id);
  const std::uint64_t points_before = study.table.size();
  if (growth.kind != Growth::Kind::kLonger || read.table.size() <= points_before) {
    core_.ports.reply_error(
        client,
        fmt::format("there is a study called \"{}\" with {}. A study may grow by blocks "
                    "after its existing ones, but not change:\n{}\n"
                    "Choose another name (--name) or another database (--db)",
                    study.name,
                    growth.kind == Growth::Kind::kShorter ? "more points" : "another recipe",
                    growth.difference));
    return;
  }
  if (study.reuse.lookup) {
    core_.ports.reply_error(
        client,
        "the study cannot grow while results of other studies are being looked up "
        "for it: submit again when `oblique status` no longer shows the lookup");
    return;
  }
  const bool is_open = core_.states.is_open(id);
  if (!may_open(client, is_open ? 0 : 1, read.table.size() - (is_open ? points_before : 0))) {
    return;
  }
  const protocol::StudyStatus before = study_status(id, core_, now);
  const bool reuses = should_look_up(read, before.solver_version());
  const auto on_stored = [this, client, id, table = read.table, priority, points_before,
                          was = before.state(), reuses](Instant then) {
    StudyRecord& grown = core_.states.record(id);
    grown.priority = priority;
    grown.is_doubtful = false;
    core_.states.grow(id, table);
    log(id, fmt::format("grows from {} to {} points", points_before, table.size()));
    if (reuses) {
      core_.feed(StudyHeld{id, true}, then);
    }
    core_.feed(StudyGrown{id, table, priority}, then);
    if (reuses) {
      look_up(id, then);
    }
    protocol::SubmitReply reply;
    reply.set_appended(table.size() - points_before);
    reply.set_was(was);
    reply_submitted(client, id, std::move(reply), then);
  };
  write(client, id, GrowStudy{id, read.table, priority, iso_8601(now), reuses}, on_stored);
  pending_.at(id).grows = true;
}

void StudyChanges::set_priority(const Client& client, StudyId id, std::int32_t priority) {
  write(client, id, SetPriority{id, priority}, [this, client, id, priority](Instant then) {
    core_.states.record(id).priority = priority;
    core_.feed(PriorityChanged{id, priority}, then);
    change_state(client, id, StudyState::kRunning, submitted_reply(client, id), then);
  });
}

// ---- Change ------------------------------------------------------------------------------------

void StudyChanges::change(const Client& client, const protocol::ChangeRequest& request,
                          Instant now) {
  const auto known = core_.states.find_durable(request.study(), request.study_id());
  if (!known) {
    const bool was_deleted = request.change() == protocol::STUDY_CHANGE_DELETE &&
                             request.study_id() != 0 && request.study_id() <= last_study_id_;
    if (was_deleted) {
      protocol::StudyStatus study;
      study.set_study_id(request.study_id());
      study.set_name(request.study());
      study.set_state(kDeletedState);
      reply_changed(client, study);
    } else {
      core_.ports.reply_error(client, unknown_study(request.study(), core_.states),
                              protocol::ERROR_CODE_NO_SUCH_STUDY);
    }
    return;
  }
  const StudyId id = *known;
  if (defers(client, id,
             [this, client, request](Instant then) { change(client, request, then); })) {
    return;
  }
  const auto reply = [this, client, id](Instant then) {
    reply_changed(client, study_status(id, core_, then));
  };
  switch (request.change()) {
    case protocol::STUDY_CHANGE_CANCEL:
      return change_state(client, id, StudyState::kCancelled, reply, now);
    case protocol::STUDY_CHANGE_PAUSE:
      return change_state(client, id,
                          core_.states.record(id).state == StudyState::kCancelled
                              ? StudyState::kCancelled
                              : StudyState::kPaused,
                          reply, now);
    case protocol::STUDY_CHANGE_RESUME:
      return change_state(client, id, StudyState::kRunning, reply, now);
    case protocol::STUDY_CHANGE_RETRY:
      return retry(client, id, now);
    case protocol::STUDY_CHANGE_RENAME:
      return rename(client, request, id, now);
    case protocol::STUDY_CHANGE_DELETE:
      return remove(client, id);
    default:
      core_.ports.reply_error(client, "unknown kind of change", protocol::ERROR_CODE_WRONG_REQUEST);
      break;
  }
}

/// Changes the state of a study. Replies at once if the study already has the state.
void StudyChanges::change_state(const Client& client, StudyId id, StudyState wanted,
                                const OnStored& reply, Instant now) {
  if (!core_.states.needs_write(id, wanted)) {
    reply(now);
    return;
  }
  if (wanted == StudyState::kRunning && !may_reopen(client, id)) {
    return;
  }
  const auto on_stored = [this, id, wanted, reply](Instant then) {
    core_.states.set_state(id, wanted);
    if (wanted == StudyState::kRunning) {
      log(id, "resumes");
      core_.feed(StudyReopened{id}, then);
    } else {
      log(id, fmt::format("is {}", state_name(wanted)));
      core_.feed(wanted == StudyState::kPaused ? Event(StudyPaused{id}) : StudyCancelled{id}, then);
    }
    reply(then);
  };
  write(client, id, SetStudyState{id, wanted, iso_8601(now)}, on_stored);
}

void StudyChanges::retry(const Client& client, StudyId id, Instant now) {
  const IntervalSet failures = core_.states.record(id).failures;
  if (failures.empty()) {
    reply_changed(client, study_status(id, core_, now));
    return;
  }
  try {
    (void)core_.states.record(id).table.get();
  } catch (const std::runtime_error& error) {
    core_.ports.reply_error(
        client, fmt::format("the recipe of the study cannot be read: {}", error.what()));
    return;
  }
  if (core_.states.record(id).state == StudyState::kDone && !may_reopen(client, id)) {
    return;
  }
  write(client, id, ForgetFailures{id, failures, iso_8601(now)},
        [this, client, id, failures](Instant then) {
          core_.rates.forget(id);  // the number of completed points becomes smaller
          StudyRecord& study = core_.states.record(id);
          failures.for_each(
              [&](const Interval& gone) { study.failures.erase(gone.begin, gone.end); });
          study.since_ms = then.steady_ms;
          if (study.state == StudyState::kDone) {
            core_.states.reopen(id);
          }
          log(id, fmt::format("solves {} failed points again", failures.size()));
          core_.feed(FailuresForgotten{id, failures}, then);
          reply_changed(client, study_status(id, core_, then), failures.size());
        });
}

void StudyChanges::rename(const Client& client, const protocol::ChangeRequest& request, StudyId id,
                          Instant now) {
  const std::string& name = request.new_name();
  const auto owner = core_.states.find(name);
  if (const std::string reason = protocol::study_name_error(name); !reason.empty()) {
    core_.ports.reply_error(client, reason, protocol::ERROR_CODE_WRONG_REQUEST);
  } else if (owner == id) {
    reply_changed(client, study_status(id, core_, now));
  } else if (owner) {
    if (!defers(client, *owner,
                [this, client, request](Instant then) { change(client, request, then); })) {
      core_.ports.reply_error(
          client, fmt::format("there is already a study called \"{}\": choose another name", name));
    }
  } else {
    core_.states.reserve(id, name);
    write(
        client, id, RenameStudy{id, name},
        [this, client, id, name](Instant then) {
          log(id, fmt::format("was renamed to {}", name));
          core_.states.rename(id, name);
          reply_changed(client, study_status(id, core_, then));
        },
        [this, name] { core_.states.release(name); });
  }
}

void StudyChanges::remove(const Client& client, StudyId id) {
  write(client, id, DeleteStudy{id}, [this, client, id](Instant then) {
    protocol::StudyStatus last = study_status(id, core_, then);
    last.set_state(kDeletedState);
    log(id, "was deleted");
    core_.rates.forget(id);
    core_.states.remove(id);
    release_replies(then);
    core_.feed(StudyRemoved{id}, then);
    reply_changed(client, last);
  });
}

void StudyChanges::finish(StudyId id, Instant now) {
  const auto pending = pending_.find(id);
  if (pending != pending_.end() && pending->second.grows) {
    pending->second.is_complete = true;
  } else if (core_.states.finish(id)) {
    log(id, "is done");
    core_.ledger.write(SetStudyState{id, StudyState::kDone, iso_8601(now)});
  }
}

// ---- Bounds and replies ------------------------------------------------------------------------

/// Returns whether the limits allow further studies and points. If not, the client gets an error.
bool StudyChanges::may_open(const Client& client, std::uint64_t studies, std::uint64_t points) {
  const auto fits = [&](const char* what, std::uint64_t open, std::uint64_t more,
                        std::uint64_t most, const char* option = "") {
    if (open <= most && more <= most - open) {
      return true;
    }
    core_.ports.reply_error(
        client,
        fmt::format("{} {} are open, and at most {} are allowed{}: wait until some studies are "
                    "done, or cancel some",
                    open, what, most, option));
    return false;
  };
  return fits("studies", core_.states.unfinished().size(), studies, bounds_.studies) &&
         fits("points", core_.states.open_points(), points, bounds_.points,
              " (--limits-open-points)");
}

bool StudyChanges::may_reopen(const Client& client, StudyId id) {
  return core_.states.is_open(id) || may_open(client, 1, core_.states.record(id).table.size());
}

StudyChanges::OnStored StudyChanges::submitted_reply(const Client& client, StudyId id) {
  return [this, client, id](Instant now) { reply_submitted(client, id, {}, now); };
}

/// Sends the reply when the lookup of results has ended, at the latest after `kLongestWait_ms`.
void StudyChanges::reply_submitted(const Client& client, StudyId id, protocol::SubmitReply reply,
                                   Instant now) {
  constexpr std::int64_t kLongestWait_ms = 1500;
  held_.push_back({id, client, std::move(reply), now.steady_ms + kLongestWait_ms});
  release_replies(now);
}

void StudyChanges::release_replies(Instant now) {
  std::erase_if(held_, [&](const HeldReply& held) {
    if (!core_.states.contains(held.study)) {
      core_.ports.reply_error(held.client, "the study was deleted before the reply");
      return true;
    }
    const Reuse& reuse = core_.states.record(held.study).reuse;
    if (reuse.lookup && held.until_ms > now.steady_ms) {
      return false;
    }
    const StudyCounts counts = core_.scheduler.study(held.study);
    protocol::ClientReply message;
    protocol::SubmitReply& fields = *message.mutable_submit();
    fields = held.reply;
    fields.set_study_id(held.study);
    fields.set_points(counts.points);
    fields.set_completed(counts.completed);
    *fields.mutable_reused() = reuse_status(reuse);
    core_.ports.reply(held.client, std::move(message));
    return true;
  });
}

void StudyChanges::reply_changed(const Client& client, const protocol::StudyStatus& study,
                                 std::uint64_t retried) {
  protocol::ClientReply reply;
  *reply.mutable_change()->mutable_study() = study;
  reply.mutable_change()->set_retried(retried);
  core_.ports.reply(client, std::move(reply));
}

// ---- Results of other studies ------------------------------------------------------------------

/// Returns whether a study should reuse results. `solver_version` is the version of the study's own
/// results; empty if it has none.
bool StudyChanges::should_look_up(const ReadRequest& read, std::string_view solver_version) const {
  return !read.request.submit().no_reuse() && core_.states.have_results() &&
         (solver_version.empty() || solver_version == core_.solver_version);
}

void StudyChanges::look_up(StudyId id, Instant now) {
  core_.states.record(id).reuse.lookup = Reuse::Lookup{now.steady_ms};
  write_part(id, 0);
}

void StudyChanges::write_part(StudyId id, std::uint64_t first_point) {
  const StudyRecord& study = core_.states.record(id);
  try {
    auto outcome = std::make_shared<ReusedResults>();
    core_.ledger.write(
        ReuseResults{id, study.table.get(), first_point, core_.solver_version, outcome},
        [this, id, outcome](Instant now) { part_stored(id, *outcome, now); },
        [this, id](const std::string& error, Instant /*now*/) { part_refused(id, error); });
  } catch (const std::runtime_error& error) {  // another server version may have stored the recipe
    log(id, fmt::format("reuses no results: {}", error.what()));
    write_end(id);
  }
}

void StudyChanges::part_stored(StudyId id, const ReusedResults& part, Instant now) {
  if (!core_.states.contains(id)) {
    return;  // the study was deleted
  }
  Reuse& reuse = core_.states.record(id).reuse;
  reuse.add(part.origins);
  if (part.points.empty()) {
    reuse.lookup->probes_in_vain += part.probes;
  } else {
    *reuse.lookup = {reuse.lookup->began_ms, now.steady_ms};
    core_.feed(PointsReused{id, part.points}, now);
  }
  if (lookups_stop_) {
    return;
  }
  const bool goes_on = part.next_point && core_.states.record(id).state != StudyState::kCancelled;
  reuse.cut_short = goes_on && (reuse.lookup->probes_in_vain >= kMaxProbesInVain ||
                                now.steady_ms - reuse.lookup->last_result_ms >= kLongestInVain_ms ||
                                now.steady_ms - reuse.lookup->began_ms >= kLongestLookup_ms);
  if (goes_on && !reuse.cut_short) {
    write_part(id, *part.next_point);
  } else {
    write_end(id);
  }
}

/// Handles a part of the lookup that failed. The remaining points will be solved.
void StudyChanges::part_refused(StudyId id, const std::string& error) {
  if (core_.ledger.is_gone() || !core_.states.contains(id)) {
    return;
  }
  log(id, fmt::format("stops reusing results of other studies: {}", error));
  core_.states.record(id).reuse.cut_short = true;
  write_end(id);
}

void StudyChanges::write_end(StudyId id) {
  core_.ledger.write(EndReuse{id}, [this, id](Instant now) { end_stored(id, now); });
}

void StudyChanges::end_stored(StudyId id, Instant now) {
  if (!core_.states.contains(id)) {
    return;
  }
  StudyRecord& study = core_.states.record(id);
  study.reuse.lookup.reset();
  if (study.reuse.points > 0) {
    std::string origins;
    for (const auto& [source, points] : study.reuse.origins) {
      origins += fmt::format("{}{} of {}", origins.empty() ? "" : ", ", points, source);
    }
    log(id, fmt::format("reuses {} results: {}", study.reuse.points, origins));
  }
  core_.feed(StudyHeld{id, false}, now);
  release_replies(now);
}

void StudyChanges::log(StudyId id, const std::string& what) {
  core_.ports.log(Severity::kInfo, fmt::format("study {} {}", core_.states.record(id).name, what));
}

}  // namespace oblique::server
