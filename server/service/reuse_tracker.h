#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "proto/oblique.pb.h"
#include "server/scheduler/scheduler_events.h"
#include "server/service/study_states.h"
#include "server/service/write_ledger.h"

namespace oblique::server {

/// Passes an event to the scheduler and carries out its effects.
using Feed = std::function<void(const Event&, Instant)>;

/// Looks up results of other studies, part by part, and records which results a study reuses. The
/// scheduler must hold a study while its lookup is under way. Not thread-safe.
class ReuseTracker {
 public:
  /// A lookup ends early after so many probes, or so long, without a result.
  static constexpr std::uint64_t kMostProbesInVain = 1'000'000;
  static constexpr std::int64_t kLongestInVain_ms = 1500;

  /// Results of `solver_version` are reused; empty: none. `on_end` is called after each lookup.
  /// The references must outlive this.
  ReuseTracker(std::string solver_version, Ports& ports, const StudyStates& states,
               WriteLedger& ledger, Feed feed, std::function<void(Instant)> on_end)
      : solver_version_(std::move(solver_version)),
        ports_(ports),
        states_(states),
        ledger_(ledger),
        feed_(std::move(feed)),
        on_end_(std::move(on_end)) {}

  /// The study has results, which others can reuse.
  void add_source(StudyId id) { sources_.insert(id); }
  /// Adds reused results that the database has, by the name that their source had.
  void restore(StudyId id, const std::map<std::string, std::uint64_t>& origins);
  /// Whether a study with results of `version` (empty: without results) can reuse any.
  bool should_look_up(StudyId id, std::string_view version) const;

  /// Starts a lookup of all open points. One that is under way starts again at its end; that of a
  /// cancelled study ends with the part that is being written.
  void begin(StudyId id, Instant now);
  /// Starts no further part of any lookup. The next server continues.
  void stop_all() { stopping_ = true; }
  void forget(StudyId id);

  bool is_under_way(StudyId id) const;
  /// Empty without anything to report.
  protocol::TakenOver status(StudyId id) const;

 private:
  struct Lookup {
    std::int64_t last_result_ms;
    std::uint64_t probes_in_vain = 0;
    bool begins_again = false;  ///< the study has grown
  };
  struct Reused {
    std::map<std::string, std::uint64_t> origins;  ///< points by name of the source
    std::uint64_t points = 0;
    bool cut_short = false;
    std::optional<Lookup> lookup;
  };

  void write_part(StudyId id, std::uint64_t first_point);
  void part_stored(StudyId id, const ReusedResults& part, Instant now);
  void part_refused(StudyId id, const std::string& error);
  std::optional<std::uint64_t> next_part(StudyId id, const ReusedResults& part, Instant now);
  void write_end(StudyId id);
  void end_stored(StudyId id, Instant now);

  std::string solver_version_;
  Ports& ports_;
  const StudyStates& states_;
  WriteLedger& ledger_;
  Feed feed_;
  std::function<void(Instant)> on_end_;
  std::set<StudyId> sources_;
  std::map<StudyId, Reused> reused_;
  bool stopping_ = false;
};

}  // namespace oblique::server
