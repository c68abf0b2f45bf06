#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"
#include "server/service/ports.h"
#include "server/service/status.h"
#include "server/study/limits.h"
#include "server/study/study_table.h"

namespace oblique::server {

/// A parsed request of a client and, for a submission, the table of its recipe.
struct ReadRequest {
  bool is_readable = false;             ///< if false, only the request number is valid
  std::uint64_t request_id = 0;         ///< 0 if the number cannot be read
  protocol::ClientRequest request;      ///< without the recipe, which is in `table`
  StudyTable table;                     ///< set if the recipe is valid
  std::string recipe_error;             ///< why the recipe is invalid; empty if it is valid
  bool needs_point_validation = false;  ///< true if the points must still be validated
};

/// Parses one frame, unless the parsed message would need too much memory (frame_scan.h). If
/// `validates_points`, also calls PointTable::validate_points, which may take a second.
ReadRequest read_request(std::string_view frame, bool validates_points = true);

/// Limits on the number of studies that are neither done nor cancelled, and of their points.
struct StudyBounds {
  std::uint64_t studies = limits::kOpenStudies;
  std::uint64_t points = limits::kOpenPoints;
};

/// Handles requests that change a study: submit, grow, pause, resume, cancel, retry, rename,
/// delete. When a change is durable it takes effect and the client gets its reply. Until then later
/// requests for that study wait. Not thread-safe.
class StudyChanges {
 public:
  /// `last_study_id` is the highest study number in the database.
  StudyChanges(std::uint64_t last_study_id, const StudyBounds& bounds, const Core& core)
      : last_study_id_(last_study_id), bounds_(bounds), core_(core) {}

  /// Handles a submission with a valid recipe.
  void submit(const Client& client, const ReadRequest& read, Instant now);
  void change(const Client& client, const protocol::ChangeRequest& request, Instant now);
  /// Sets a study to done, because all its points are completed. While points are being added, only
  /// records that the earlier points are completed.
  void finish(StudyId id, Instant now);
  /// Sends pending replies to submissions if the lookup of reusable results has ended or takes
  /// long, or the study is gone.
  void release_replies(Instant now);

  /// A lookup ends early after this number of probes, or after this time, without a result.
  static constexpr std::uint64_t kMaxProbesInVain = 1'000'000;
  static constexpr std::int64_t kLongestInVain_ms = 1500;
  /// A lookup ends early after this time, even if it finds results.
  static constexpr std::int64_t kLongestLookup_ms = 30'000;
  /// Looks up results of other studies for all open points, in parts. The scheduler must hold the
  /// study meanwhile. If the study is cancelled, the lookup ends after its current part.
  void look_up(StudyId id, Instant now);
  /// Stops all lookups after their current part. The next start of the server continues them.
  void stop_lookups() { lookups_stop_ = true; }

 private:
  /// A change that is being written, and the requests that wait for it.
  struct Pending {
    bool grows = false;        ///< true if the change adds points
    bool is_complete = false;  ///< true if all earlier points have been completed
    std::vector<std::function<void(Instant)>> deferred{};  ///< later requests for the study
  };
  /// A reply to a submission, which waits for the lookup of reusable results.
  struct HeldReply {
    StudyId study;
    Client client;
    protocol::SubmitReply reply;
    std::int64_t until_ms;
  };
  using OnStored = std::function<void(Instant)>;

  void write(
      const Client& client, StudyId id, Change change, OnStored on_stored,
      std::function<void()> on_refused = [] {});
  bool defers(const Client& client, StudyId id, std::function<void(Instant)> request);
  void add(const Client& client, const ReadRequest& read, std::int32_t priority, Instant now);
  void grow(const Client& client, StudyId id, const ReadRequest& read, const Growth& growth,
            std::int32_t priority, Instant now);
  void set_priority(const Client& client, StudyId id, std::int32_t priority);
  void change_state(const Client& client, StudyId id, StudyState wanted, const OnStored& reply,
                    Instant now);
  OnStored submitted_reply(const Client& client, StudyId id);
  void retry(const Client& client, StudyId id, Instant now);
  void rename(const Client& client, const protocol::ChangeRequest& request, StudyId id,
              Instant now);
  void remove(const Client& client, StudyId id);
  bool may_open(const Client& client, std::uint64_t studies, std::uint64_t points);
  bool may_reopen(const Client& client, StudyId id);
  void reply_submitted(const Client& client, StudyId id, protocol::SubmitReply reply, Instant now);
  void reply_changed(const Client& client, const protocol::StudyStatus& study,
                     std::uint64_t retried = 0);
  void log(StudyId id, const std::string& what);
  bool should_look_up(const ReadRequest& read, std::string_view solver_version) const;
  void write_part(StudyId id, std::uint64_t first_point);
  void part_stored(StudyId id, const ReusedResults& part, Instant now);
  void part_refused(StudyId id, const std::string& error);
  void write_end(StudyId id);
  void end_stored(StudyId id, Instant now);

  std::uint64_t last_study_id_;
  StudyBounds bounds_;
  const Core& core_;
  std::map<StudyId, Pending> pending_;
  std::vector<HeldReply> held_;
  bool lookups_stop_ = false;
};

/// Returns the error message for an unknown study.
std::string unknown_study(const std::string& name, const StudyStates& states);

}  // namespace oblique::server
