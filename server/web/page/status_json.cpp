#include "server/web/page/status_json.h"
#include "proto/study_counts.h"

namespace oblique::server {
namespace {

/// Heartbeats come in between, and say nothing that people want to see.
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
          {"weight", study.weight()},
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

}  // namespace oblique::server
