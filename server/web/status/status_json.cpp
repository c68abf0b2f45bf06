#include "server/web/status/snapshot.h"

#include <cstddef>
#include <cstdint>
#include <utility>

#include "proto/study_counts.h"
#include "server/web/http/http_message.h"

namespace oblique::server {
namespace {

/// A shorter silence is the usual time between heartbeats.
constexpr std::uint32_t kSilence_ms = 2000;

}  // namespace

nlohmann::ordered_json study_json(const protocol::StudyStatus& study) {
  const auto open = static_cast<double>(protocol::open_points(study));
  const bool is_known = study.state() == "running" && study.points_per_s() > 0.0;
  return {{"id", study.study_id()},
          {"name", study.name()},
          {"state", study.state()},
          {"points", study.points()},
          {"solved", study.solved()},
          {"failed", study.failed()},
          {"left_out", study.left_out()},
          {"leased", study.leased()},
          {"points_per_s", study.points_per_s()},
          {"left_s", is_known ? nlohmann::ordered_json(open / study.points_per_s()) : nullptr},
          {"waits_for", study.waits_for()},
          {"priority", study.priority()},
          {"solver_version", study.solver_version()},
          {"created_at", study.created_at()},
          {"submitted_by", study.submitted_by()},
          {"taken_over", study.taken().points()}};
}

nlohmann::ordered_json worker_json(const protocol::WorkerStatus& worker) {
  return {{"id", worker.worker_id()},
          {"name", worker.name()},
          {"host", worker.host()},
          {"threads", worker.threads()},
          {"state", worker.state()},
          {"points_per_s", worker.points_per_s()},
          {"leased_points", worker.leased_points()},
          {"solved_points", worker.solved_points()},
          {"silent_s", worker.silent_ms() < kSilence_ms ? 0 : worker.silent_ms() / 1000},
          {"losses", worker.losses()},
          {"solver_version", worker.solver_version()},
          {"instruction_set", worker.instruction_set()}};
}

std::string overview_json(const Snapshot& snapshot) {
  using nlohmann::ordered_json;
  ordered_json states;
  for (std::size_t i = 0; i < snapshot.studies_by_state.size(); ++i) {
    states[state_name(static_cast<StudyState>(i))] = snapshot.studies_by_state.at(i);
  }
  ordered_json studies = ordered_json::array();
  for (const auto& study : snapshot.studies) {
    studies.push_back(study_json(study));
  }
  ordered_json workers = ordered_json::array();
  for (const auto& worker : snapshot.workers) {
    workers.push_back(worker_json(worker));
  }
  std::uint64_t workers_there = 0;
  std::uint64_t threads = 0;
  for (const WorkerGroup& group : snapshot.groups) {
    workers_there += group.workers;
    threads += group.threads;
  }
  return json_text({{"studies", std::move(studies)},
                    {"unlisted", snapshot.unlisted},
                    {"studies_by_state", std::move(states)},
                    {"workers", std::move(workers)},
                    {"workers_there", workers_there},
                    {"threads", threads},
                    {"points_open", snapshot.points_open},
                    {"points_leased", snapshot.points_leased},
                    {"points_per_s", snapshot.points_per_s},
                    {"threads_wanted", snapshot.threads_wanted()},
                    {"thread_s_per_point", snapshot.thread_s_per_point},
                    {"database_fault", snapshot.database_fault},
                    {"is_stopping", snapshot.is_stopping}});
}

}  // namespace oblique::server
