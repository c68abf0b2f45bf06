#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "proto/oblique.pb.h"
#include "server/scheduler/scheduler.h"
#include "server/service/counts/settled_rates.h"
#include "server/service/counts/study_states.h"
#include "server/service/take_overs.h"
#include "server/service/workers_desk.h"
#include "server/service/write_ledger.h"

// Studies and workers as others see them: plain values, from which replies are made, and whatever
// else shows how things stand.
namespace oblique::server {

struct StudyView {
  StudyId id;
  std::string name;
  StudyState state;  ///< done as soon as all points are settled
  std::uint64_t points;
  std::uint64_t solved;
  std::uint64_t failed;
  std::uint64_t left_out;  ///< by filters, as far as it is known
  std::uint64_t leased;
  std::string created_at;  ///< UTC, ISO 8601
  StudyTerms terms;
  std::string solver_version;   ///< of its results; empty while there are none
  std::string waits_for;        ///< why a running study does not go on; empty: it does
  double points_per_s;          ///< settled, over the last seconds; 0 unless it runs
  std::string submitted_by{};   ///< name of the key; empty: without keys
  protocol::TakenOver taken{};  ///< from other studies

  std::uint64_t settled() const { return solved + failed + left_out; }
};

/// Where a view of a study comes from.
struct StudySources {
  const Scheduler& scheduler;
  const StudyStates& states;
  const WriteLedger& ledger;
  const SettledRates& rates;
  const TakeOvers& known;
};

/// Throws std::out_of_range for a study that is not durable.
StudyView view_of(StudyId id, const StudySources& sources, Instant now);
protocol::StudyStatus to_message(const StudyView& view);

struct WorkerView {
  WorkerId id;
  std::string name;
  std::uint32_t threads;
  std::string instruction_set;
  std::string solver_version;
  WorkerCounts counts;
  std::string host;
  double points_per_s;  ///< solved and stored, over the last seconds
  bool is_busy;         ///< it does not read what it is sent
  std::string key{};    ///< its name; empty: without keys
};

/// Points that are neither solved, failed nor known to be left out.
std::uint64_t open_points_of(StudyId id, const StudySources& sources);

WorkerView view_of(WorkerId id, const WorkerRecord& worker, const Scheduler& scheduler,
                   const SettledRates& rates, Instant now);
/// The first so many workers.
std::vector<WorkerView> first_workers(std::size_t most, const WorkersDesk& workers,
                                      const Scheduler& scheduler, const SettledRates& rates,
                                      Instant now);
/// "working", "idle", "silent" (nothing came of it lately), "busy" or "set aside".
std::string state_of(const WorkerView& view);
protocol::WorkerStatus to_message(const WorkerView& view);

}  // namespace oblique::server
