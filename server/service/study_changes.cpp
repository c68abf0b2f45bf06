#include "server/service/study_changes.h"

#include <algorithm>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "proto/recipe/model_message.h"
#include "proto/text.h"
#include "proto/wire/frame_scan.h"
#include "server/study/recipe_growth.h"

namespace oblique::server {
namespace {

constexpr std::size_t kLongestShownName = 200;
/// In place of the state of a study that was deleted.
constexpr const char* kDeletedState = "deleted";

}  // namespace

std::string unknown_study(const std::string& name, const StudyStates& states) {
  const std::string nearest = states.nearest(name);
  const std::string shown = protocol::shortened(name, kLongestShownName);
  if (!name.empty() && nearest == name) {  // the request had a number, too
    return fmt::format(
        "study name \"{}\" and study number do not match: `oblique studies` lists all", shown);
  }
  return fmt::format("there is no study called \"{}\"{}: `oblique studies` lists all", shown,
                     nearest.empty() ? "" : fmt::format(" (did you mean `{}`?)", nearest));
}

// ---- Reading -----------------------------------------------------------------------------------

ReadRequest read_request(std::string_view frame, bool judges) {
  ReadRequest read;
  // Padding cannot make much of a shorter frame.
  read.is_readable =
      (frame.size() <= limits::kLongestInlineRequest || protocol::is_of_a_requests_shape(frame)) &&
      protocol::decode(frame, read.request);
  read.request_id = read.is_readable ? read.request.request_id() : protocol::request_id_of(frame);
  if (!read.is_readable || !read.request.has_submit()) {
    return read;
  }
  try {
    protocol::Recipe& recipe = *read.request.mutable_submit()->mutable_recipe();
    protocol::check_size(recipe);
    auto table = std::make_shared<const protocol::PointTable>(std::move(recipe));
    read.needs_judging = table->needs_judging() && !judges;
    if (judges) {
      table->judge_points();
    }
    read.table = std::move(table);
  } catch (const solver::InputError& error) {
    read.objection = error.what();
  }
  read.request.mutable_submit()->clear_recipe();
  return read;
}

// ---- Writing -----------------------------------------------------------------------------------

/// Writes the change. A refusal is the reply to the client, after `on_refused`.
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
        core_.ports.reply_error(client, (core_.states.contains(id)
                                             ? "the change was not stored, the study is as before: "
                                             : "the study was not stored: ") +
                                            error);
        if (ended.mapped().is_complete) {
          finish(id, now);
        }
        run_deferred(ended.mapped(), now);
      });
}

/// Whether the request waits until the change of the study that is being written has an outcome. It
/// is handled again then.
bool StudyChanges::defers(const Client& client, StudyId id, std::function<void(Instant)> request) {
  const auto pending = pending_.find(id);
  if (pending == pending_.end()) {
    return false;
  }
  if (pending->second.deferred.size() >= limits::kDeferredRequests) {
    core_.ports.reply_error(client, "too many changes of that study wait already: ask again later");
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
  for (const std::string& reason : {protocol::objection_to_study_name(request.name()),
                                    protocol::objection_to_priority(priority), read.objection}) {
    if (!reason.empty()) {
      core_.ports.reply_error(client, reason);
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
  if (!study.table.is_of_the_recipe_of(read.table)) {
    grow(client, *known, read, priority, now);
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
  const bool reuses = !read.request.submit().no_reuse() && core_.reuse.should_look_up(id, {});
  core_.states.add(id, {name, read.table, created_at, priority, {}, now.steady_ms, client.key()});
  const auto on_stored = [this, client, id, reuses](Instant then) {
    core_.states.set_durable(id, then.steady_ms);
    const StudyRecord& study = core_.states.record(id);
    log(id, fmt::format("of {} points begins", study.table.size()));
    StudyAdded event{id, study.table, {}, 0, false, false, study.priority};
    event.held = reuses;
    core_.feed(event, then);
    if (reuses) {
      core_.reuse.begin(id, then);
    }
    reply_submitted(client, id, true, then);
  };
  write(client, id, AddStudy{id, name, read.table, created_at, priority, client.key(), reuses},
        on_stored, [this, id] { core_.states.remove(id); });
}

/// The submitted recipe is not that of the study: appends its further points, or refuses it.
void StudyChanges::grow(const Client& client, StudyId id, const ReadRequest& read,
                        std::int32_t priority, Instant now) {
  const StudyRecord& study = core_.states.record(id);
  const std::uint64_t points_before = study.table.size();
  Growth growth{Growth::Kind::kOther, "the stored one cannot be read"};
  try {
    growth = study.table.growth_to(read.table);
  } catch (const std::runtime_error&) {
    // Only another version can read it.
  }
  if (growth.kind != Growth::Kind::kLonger || read.table.size() <= points_before) {
    core_.ports.reply_error(
        client,
        fmt::format("there is a study called \"{}\" with {}. A study may grow by blocks "
                    "behind those that it has, and never change:\n{}\n"
                    "Give this one another name (--name), or use another database (--db)",
                    study.name,
                    growth.kind == Growth::Kind::kShorter ? "more points" : "another recipe",
                    growth.difference));
    return;
  }
  const bool is_open = core_.states.is_open(id);
  if (!may_open(client, is_open ? 0 : 1, read.table.size() - (is_open ? points_before : 0))) {
    return;
  }
  const protocol::StudyStatus before = study_status(id, core_, now);
  const bool reuses =
      !read.request.submit().no_reuse() && core_.reuse.should_look_up(id, before.solver_version());
  const auto on_stored = [this, client, id, table = read.table, priority, points_before,
                          was = before.state(), reuses](Instant then) {
    core_.states.grow(id, table, priority);
    log(id, fmt::format("grows from {} to {} points", points_before, table.size()));
    if (reuses) {
      core_.feed(StudyHeld{id, true}, then);
    }
    core_.feed(StudyGrown{id, table, priority}, then);
    if (reuses) {
      core_.reuse.begin(id, then);
    }
    protocol::SubmitReply more;
    more.set_appended(table.size() - points_before);
    more.set_was(was);
    reply_submitted(client, id, false, then, more);
  };
  write(client, id, GrowStudy{id, read.table, priority, iso_8601(now), reuses}, on_stored,
        [this, id] { core_.states.set_doubtful(id); });
  pending_.at(id).grows = true;
}

void StudyChanges::set_priority(const Client& client, StudyId id, std::int32_t priority) {
  write(client, id, SetPriority{id, priority}, [this, client, id, priority](Instant then) {
    core_.states.set_priority(id, priority);
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
      reply_deleted(client, study);
    } else {
      core_.ports.reply_error(client, unknown_study(request.study(), core_.states));
    }
    return;
  }
  const StudyId id = *known;
  if (defers(client, id,
             [this, client, request](Instant then) { change(client, request, then); })) {
    return;
  }
  const auto reply = [this, client, id](Instant then) { reply_changed(client, id, 0, then); };
  switch (request.change()) {
    case protocol::STUDY_CHANGE_CANCEL:
      change_state(client, id, StudyState::kCancelled, reply, now);
      break;
    case protocol::STUDY_CHANGE_PAUSE:
      // Nothing of a cancelled study is handed out either.
      change_state(client, id,
                   core_.states.state(id) == StudyState::kCancelled ? StudyState::kCancelled
                                                                    : StudyState::kPaused,
                   reply, now);
      break;
    case protocol::STUDY_CHANGE_RESUME:
      change_state(client, id, StudyState::kRunning, reply, now);
      break;
    case protocol::STUDY_CHANGE_RETRY:
      retry(client, id, now);
      break;
    case protocol::STUDY_CHANGE_RENAME:
      rename(client, request, id, now);
      break;
    case protocol::STUDY_CHANGE_DELETE:
      remove(client, id);
      break;
    default:
      core_.ports.reply_error(client, "the server does not know this change of a study");
      break;
  }
}

/// The reply is sent at once if the study has the state already.
void StudyChanges::change_state(const Client& client, StudyId id, StudyState wanted,
                                std::function<void(Instant)> reply, Instant now) {
  if (!core_.states.needs_write(id, wanted)) {
    reply(now);
    return;
  }
  if (wanted == StudyState::kRunning && !may_reopen(client, id)) {
    return;
  }
  const auto on_stored = [this, id, wanted, reply = std::move(reply)](Instant then) {
    core_.states.set_state(id, wanted);
    if (wanted == StudyState::kRunning) {
      log(id, "goes on");
      core_.feed(StudyReopened{id}, then);
    } else {
      log(id, fmt::format("is {}", state_name(wanted)));
      core_.feed(wanted == StudyState::kPaused ? Event(StudyPaused{id}) : StudyCancelled{id}, then);
    }
    reply(then);
  };
  write(client, id, SetStudyState{id, wanted, iso_8601(now)}, on_stored,
        [this, id] { core_.states.set_doubtful(id); });
}

void StudyChanges::retry(const Client& client, StudyId id, Instant now) {
  const IntervalSet failures = core_.states.record(id).failures;
  if (failures.empty()) {
    reply_changed(client, id, 0, now);
    return;
  }
  try {
    (void)core_.states.record(id).table.get();
  } catch (const std::runtime_error& error) {
    core_.ports.reply_error(
        client, fmt::format("the recipe of the study cannot be read: {}", error.what()));
    return;
  }
  if (core_.states.state(id) == StudyState::kDone && !may_reopen(client, id)) {
    return;
  }
  write(client, id, ForgetFailures{id, failures, iso_8601(now)},
        [this, client, id, failures](Instant then) {
          core_.rates.forget(id);  // fewer points are completed now
          core_.states.forget_failures(id, failures, then.steady_ms);
          log(id, fmt::format("tries its failed points again: {}", failures.size()));
          core_.feed(FailuresForgotten{id, failures}, then);
          reply_changed(client, id, failures.size(), then);
        });
}

void StudyChanges::rename(const Client& client, const protocol::ChangeRequest& request, StudyId id,
                          Instant now) {
  const std::string& name = request.new_name();
  const auto owner = core_.states.find(name);
  if (const std::string reason = protocol::objection_to_study_name(name); !reason.empty()) {
    core_.ports.reply_error(client, reason);
  } else if (owner == id) {
    reply_changed(client, id, 0, now);
  } else if (owner) {
    if (!defers(client, *owner,
                [this, client, request](Instant then) { change(client, request, then); })) {
      core_.ports.reply_error(
          client, fmt::format("there is a study called \"{}\" already: choose another name", name));
    }
  } else {
    core_.states.reserve(id, name);
    write(
        client, id, RenameStudy{id, name},
        [this, client, id, name](Instant then) {
          log(id, fmt::format("is called {} from now on", name));
          core_.states.rename(id, name);
          reply_changed(client, id, 0, then);
        },
        [this, name] { core_.states.release(name); });
  }
}

void StudyChanges::remove(const Client& client, StudyId id) {
  write(client, id, DeleteStudy{id}, [this, client, id](Instant then) {
    const protocol::StudyStatus last = study_status(id, core_, then);
    log(id, "is deleted");
    core_.rates.forget(id);
    core_.states.remove(id);
    core_.reuse.forget(id);
    release_replies(then, id);
    core_.feed(StudyRemoved{id}, then);
    reply_deleted(client, last);
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

/// Whether so many further studies and points may be open; otherwise the client gets the bound.
bool StudyChanges::may_open(const Client& client, std::uint64_t studies, std::uint64_t points) {
  const auto fits = [&](const char* what, std::uint64_t open, std::uint64_t more,
                        std::uint64_t most, const char* option = "") {
    if (open <= most && more <= most - open) {
      return true;
    }
    core_.ports.reply_error(
        client,
        fmt::format("{} {} are open, and the server allows {}{}: wait until some studies are "
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

/// While results of other studies are looked up the reply waits for them, but not long.
void StudyChanges::reply_submitted(const Client& client, StudyId id, bool created, Instant now,
                                   const protocol::SubmitReply& more) {
  constexpr std::int64_t kLongestWait_ms = 1500;
  const StudyCounts counts = core_.scheduler.study(id);
  protocol::ClientReply reply;
  protocol::SubmitReply& fields = *reply.mutable_submit();
  fields = more;
  fields.set_study_id(id);
  fields.set_points(counts.points);
  fields.set_settled(counts.settled);
  fields.set_created(created);
  if (core_.reuse.is_under_way(id)) {
    held_.push_back({id, client, std::move(reply), now.steady_ms + kLongestWait_ms});
  } else {
    core_.ports.reply(client, std::move(reply));
  }
}

void StudyChanges::release_replies(Instant now, StudyId id) {
  const auto waits = [&](const HeldReply& held) {
    return held.study != id && held.until_ms > now.steady_ms &&
           core_.reuse.is_under_way(held.study);
  };
  const auto first = std::stable_partition(held_.begin(), held_.end(), waits);
  std::vector<HeldReply> released(std::make_move_iterator(first),
                                  std::make_move_iterator(held_.end()));
  held_.erase(first, held_.end());
  for (HeldReply& held : released) {
    if (!core_.states.contains(held.study)) {
      core_.ports.reply_error(held.client, "the study was deleted meanwhile");
      continue;
    }
    const protocol::StudyStatus status = study_status(held.study, core_, now);
    protocol::SubmitReply& fields = *held.reply.mutable_submit();
    fields.set_settled(status.solved() + status.failed() + status.left_out());
    *fields.mutable_taken() = status.taken();
    core_.ports.reply(held.client, std::move(held.reply));
  }
}

void StudyChanges::reply_changed(const Client& client, StudyId id, std::uint64_t retried,
                                 Instant now) {
  protocol::ClientReply reply;
  *reply.mutable_change()->mutable_study() = study_status(id, core_, now);
  reply.mutable_change()->set_retried(retried);
  core_.ports.reply(client, std::move(reply));
}

void StudyChanges::reply_deleted(const Client& client, const protocol::StudyStatus& study) {
  protocol::ClientReply reply;
  *reply.mutable_change()->mutable_study() = study;
  reply.mutable_change()->mutable_study()->set_state(kDeletedState);
  core_.ports.reply(client, std::move(reply));
}

void StudyChanges::log(StudyId id, const std::string& what) {
  core_.ports.log(Severity::kInfo, fmt::format("study {} {}", core_.states.record(id).name, what));
}

}  // namespace oblique::server
