// What follows when a change is durable or refused, and what clients are told.
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "server/service/study_changes.h"

namespace oblique::server {

// ---- What became of it ------------------------------------------------------------------------

Event StudyChanges::stored(const StudyWrite& write, Instant now) {
  states_.added(write.study, now.steady_ms);
  const StudyRecord& study = states_.record(write.study);
  note(write.study, fmt::format("of {} points begins", study.table.size()));
  StudyAdded added{write.study, study.table, {}, 0, false, false, study.priority};
  added.held = write.takes_over;
  return added;
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

Event StudyChanges::stored(const PriorityWrite& write, Instant /*now*/) {
  states_.set_priority(write.study, write.priority);
  return PriorityChanged{write.study, write.priority};
}

Event StudyChanges::stored(const FailuresWrite& write, Instant now) {
  states_.forget_failures(write.study, write.points, now.steady_ms);
  note(write.study, fmt::format("tries its failed points again: {}", write.points.size()));
  return FailuresForgotten{write.study, write.points, states_.record(write.study).attempts};
}

Event StudyChanges::stored(const GrowthWrite& write, Instant /*now*/) {
  states_.grow(write.study, write.table, write.priority);
  states_.changed(write.study, StudyState::kRunning);
  note(write.study,
       fmt::format("grows from {} to {} points", write.points_before, write.table.size()));
  return StudyGrown{write.study, write.table, write.priority};
}

void StudyChanges::stored(const NameWrite& write) {
  note(write.study, fmt::format("is called {} from now on", write.name));
  states_.rename(write.study, write.name);
}

Event StudyChanges::stored(const RemovalWrite& write, Instant now) {
  auto& reply = turns_[write.study].farewell;
  reply.set_request_id(write.client.request_id);
  auto& status = *reply.mutable_change()->mutable_study();
  status = to_message(view_of(write.study, sources_, now));
  status.set_state(kDeletedState);
  note(write.study, "is deleted");
  open_.close(write.study);
  states_.remove(write.study);
  known_.forget(write.study);
  release_replies(now, write.study);
  return StudyRemoved{write.study};
}

void StudyChanges::answer(const StudyWrite& write, Instant now) {
  recount(write.study);
  const auto waiting = submitters_.extract(write.study);
  bool created = true;
  for (const Client& client : waiting.mapped()) {
    reply_submitted(client, write.study, std::exchange(created, false), now);
  }
  end_turn(write.study, now);
}

void StudyChanges::answer(const StateWrite& write, Instant now) {
  recount(write.study);
  if (write.submitted) {
    reply_submitted(write.client, write.study, false, now);
  } else {
    reply_changed(write.client, write.study, 0, now);
  }
}

void StudyChanges::answer(const PriorityWrite& write, Instant now) {
  go_on(write.client, write.study, now);
  end_turn(write.study, now);
}

void StudyChanges::answer(const FailuresWrite& write, Instant now) {
  recount(write.study);
  reply_changed(write.client, write.study, write.points.size(), now);
}

void StudyChanges::answer(const GrowthWrite& write, Instant now) {
  recount(write.study);
  for (const Client& client : turns_.at(write.study).submitters) {
    protocol::ClientReply reply = submitted(client, write.study, false, now);
    reply.mutable_submit()->set_appended(write.table.size() - write.points_before);
    reply.mutable_submit()->set_was(state_name(write.state_before));
    send_submitted({write.study, client.identity, std::move(reply)}, now);
  }
  end_turn(write.study, now);
}

void StudyChanges::answer(const NameWrite& write, Instant now) {
  reply_changed(write.client, write.study, 0, now);
  end_turn(write.study, now);
}

void StudyChanges::answer(const RemovalWrite& write, Instant now) {
  clients_.to_client(write.client.identity, turns_.at(write.study).farewell);
  end_turn(write.study, now);
}

void StudyChanges::refused(const StudyWrite& write, const std::string& error, Instant now) {
  states_.remove(write.study);
  recount(write.study);
  const auto waiting = submitters_.extract(write.study);
  for (const Client& client : waiting.mapped()) {
    clients_.reply_error(client, "the study was not stored: " + error);
  }
  end_turn(write.study, now);
}

void StudyChanges::refused(const StateWrite& write, const std::string& error) {
  states_.refused(write.study);
  recount(write.study);
  reply_unchanged(write.client, error);
}

void StudyChanges::refused(const PriorityWrite& write, const std::string& error, Instant now) {
  reply_unchanged(write.client, error);
  end_turn(write.study, now);
}

void StudyChanges::refused(const FailuresWrite& write, const std::string& error) {
  reply_unchanged(write.client, error);
}

void StudyChanges::refused(const GrowthWrite& write, const std::string& error, Instant now) {
  states_.refused(write.study);
  recount(write.study);
  const Turn& turn = turns_.at(write.study);
  if (turn.end_is_put_off) {
    ends_put_off_.insert(write.study);
  }
  for (const Client& client : turn.submitters) {
    reply_unchanged(client, error);
  }
  end_turn(write.study, now);
}

void StudyChanges::refused(const NameWrite& write, const std::string& error, Instant now) {
  states_.release(write.name);
  reply_unchanged(write.client, error);
  end_turn(write.study, now);
}

void StudyChanges::refused(const RemovalWrite& write, const std::string& error, Instant now) {
  reply_unchanged(write.client, error);
  end_turn(write.study, now);
}

// ---- Replies ----------------------------------------------------------------------------------

protocol::ClientReply StudyChanges::submitted(const Client& client, StudyId id, bool created,
                                              Instant now) const {
  const StudyView view = view_of(id, sources_, now);
  protocol::ClientReply reply;
  reply.set_request_id(client.request_id);
  auto& fields = *reply.mutable_submit();
  fields.set_study_id(id);
  fields.set_points(view.points);
  fields.set_settled(view.settled());
  fields.set_created(created);
  return reply;
}

void StudyChanges::reply_submitted(const Client& client, StudyId id, bool created, Instant now) {
  send_submitted({id, client.identity, submitted(client, id, created, now)}, now);
}

/// While points are sought in other studies the reply waits for these, but not long.
void StudyChanges::send_submitted(HeldReply reply, Instant now) {
  constexpr std::int64_t kLongestWait_ms = 1500;
  if (known_.is_under_way(reply.study_id)) {
    reply.until_ms = now.steady_ms + kLongestWait_ms;
    known_.hold(std::move(reply));
  } else {
    clients_.to_client(reply.client, reply.reply);
  }
}

void StudyChanges::release_replies(Instant now, StudyId id) {
  for (HeldReply& held : known_.release(now.steady_ms, id)) {
    if (!states_.contains(held.study_id)) {
      clients_.reply_error({held.client, held.reply.request_id()},
                           "the study was deleted meanwhile");
      continue;
    }
    const StudyView view = view_of(held.study_id, sources_, now);
    held.reply.mutable_submit()->set_settled(view.settled());
    *held.reply.mutable_submit()->mutable_taken() = view.taken;
    clients_.to_client(held.client, held.reply);
  }
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
