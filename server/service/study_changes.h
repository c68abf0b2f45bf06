#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "server/scheduler/scheduler_events.h"
#include "server/service/counts/open_studies.h"
#include "server/service/outbox/outbox.h"
#include "server/service/views.h"

namespace oblique::server {

/// What clients change: studies that are submitted, paused, resumed, cancelled, tried again, that
/// grow, get another name or are deleted. A change is handed to the ledger, and counts once that
/// gives it back as durable: then `stored` says what the scheduler is to be told, and `answer`
/// tells the client. Not thread-safe.
class StudyChanges {
 public:
  /// `last_study_id` is the last one of the database. All of these must outlive this.
  StudyChanges(std::uint64_t last_study_id, StudyStates& states, WriteLedger& ledger,
               StudySources sources, TakeOvers& known, OpenStudies& open, ToClients& clients,
               ToLog& log)
      : last_study_id_(last_study_id),
        states_(states),
        ledger_(ledger),
        sources_(sources),
        known_(known),
        open_(open),
        clients_(clients),
        log_(log) {}

  /// A study whose recipe was read and judged: a new one, or one that is there and goes on.
  void submit(const Client& client, const ReadRequest& read, Instant now);
  /// Pause, resume, cancel, retry, rename, delete.
  void change(const Client& client, const protocol::ChangeRequest& request, Instant now);

  /// Tells what is open how it is with the study, whose state or points may be others than before.
  void recount(StudyId id);

  Event stored(const StudyWrite& write, Instant now);
  Event stored(const StateWrite& write, Instant now);
  Event stored(const PriorityWrite& write, Instant now);
  Event stored(const FailuresWrite& write, Instant now);
  Event stored(const GrowthWrite& write, Instant now);
  void stored(const NameWrite& write);
  Event stored(const RemovalWrite& write, Instant now);

  /// To be called after the scheduler was told.
  void answer(const StudyWrite& write, Instant now);
  void answer(const StateWrite& write, Instant now);
  void answer(const PriorityWrite& write, Instant now);
  void answer(const FailuresWrite& write, Instant now);
  void answer(const GrowthWrite& write, Instant now);
  void answer(const NameWrite& write, Instant now);
  void answer(const RemovalWrite& write, Instant now);

  /// The database refused it, as `error` says: all is as before, and the client is told.
  void refused(const StudyWrite& write, const std::string& error, Instant now);
  void refused(const StateWrite& write, const std::string& error);
  void refused(const PriorityWrite& write, const std::string& error, Instant now);
  void refused(const FailuresWrite& write, const std::string& error);
  void refused(const GrowthWrite& write, const std::string& error, Instant now);
  void refused(const NameWrite& write, const std::string& error, Instant now);
  void refused(const RemovalWrite& write, const std::string& error, Instant now);

  /// Answers who submitted studies of which nothing is sought in others any more, or waited long
  /// for that; of that study all.
  void release_replies(Instant now, StudyId id = 0);

  /// All points that the study had are settled. True while further ones are on their way to the
  /// disk: then it has not ended, unless `takes_end` says so later.
  bool puts_off_end(StudyId id);
  /// Whether an end was put off, and the further points were refused. True once.
  bool takes_end(StudyId id);

 private:
  /// A change of the study is on its way to the disk, after which it may be another one. What else
  /// is asked of the study waits for it.
  struct Turn {
    StudyTable grown{};                ///< with these points; none: it does not grow
    std::vector<Client> submitters{};  ///< that submitted these
    protocol::ClientReply farewell{};  ///< of a study that is deleted
    bool end_is_put_off = false;
    std::vector<std::function<void(Instant)>> later{};
  };

  void add(const Client& client, const ReadRequest& read, std::int32_t priority, Instant now);
  bool may_open(const Client& client, StudyId id, std::uint64_t points);
  bool may_reopen(const Client& client, StudyId id, StudyState wanted);
  void go_on(const Client& client, StudyId id, Instant now);
  void set_state(const Client& client, StudyId id, StudyState state, bool submitted, Instant now);
  void retry(const Client& client, StudyId id, Instant now);
  bool waits(const Client& client, StudyId id, std::function<void(Instant)> later);
  void end_turn(StudyId id, Instant now);
  void grow(const Client& client, StudyId id, const ReadRequest& read, std::int32_t priority,
            Instant now);
  void refuse_recipe(const Client& client, const std::string& name, const Growth& growth);
  void change_one(const Client& client, const protocol::ChangeRequest& request, StudyId id,
                  Instant now);
  void rename(const Client& client, const protocol::ChangeRequest& request, StudyId id,
              Instant now);
  void remove(const Client& client, StudyId id);
  void reply_gone(const Client& client, const protocol::ChangeRequest& request);
  protocol::ClientReply submitted(const Client& client, StudyId id, bool created,
                                  Instant now) const;
  void reply_submitted(const Client& client, StudyId id, bool created, Instant now);
  void send_submitted(HeldReply reply, Instant now);
  void reply_changed(const Client& client, StudyId id, std::uint64_t retried, Instant now);
  void reply_unchanged(const Client& client, const std::string& error);
  void note(StudyId id, const std::string& what);

  std::uint64_t last_study_id_;
  StudyStates& states_;
  WriteLedger& ledger_;
  StudySources sources_;
  TakeOvers& known_;
  OpenStudies& open_;
  ToClients& clients_;
  ToLog& log_;
  std::map<StudyId, std::vector<Client>> submitters_;  // wait for the study to be durable
  std::map<StudyId, Turn> turns_;
  std::set<StudyId> ends_put_off_;  // of growths that were refused
};

/// In the place of the state of a study that is not there any more.
inline constexpr const char* kDeletedState = "deleted";

/// What to say of a name that no study has.
std::string unknown_study(const std::string& name, const StudyStates& states);

}  // namespace oblique::server
