#include "server/web/overview.h"

#include <cstddef>

#include <nlohmann/json.hpp>

#include "server/web/page/status_json.h"

namespace oblique::server {

std::string overview_json(const Snapshot& snapshot) {
  using nlohmann::ordered_json;
  ordered_json states;
  for (std::size_t i = 0; i < snapshot.studies.size(); ++i) {
    states[state_name(static_cast<StudyState>(i))] = snapshot.studies.at(i);
  }
  ordered_json studies = ordered_json::array();
  for (const protocol::StudyStatus& study : snapshot.shown_studies) {
    studies.push_back(study_json(study));
  }
  ordered_json workers = ordered_json::array();
  for (const protocol::WorkerStatus& worker : snapshot.shown_workers) {
    workers.push_back(worker_json(worker));
  }
  std::uint64_t there = 0;
  std::uint64_t threads = 0;
  for (const Crew& crew : snapshot.crews) {
    there += crew.workers;
    threads += crew.threads;
  }
  const ordered_json overview{{"studies", std::move(studies)},
                              {"unlisted", snapshot.unlisted},
                              {"studies_by_state", std::move(states)},
                              {"workers", std::move(workers)},
                              {"workers_there", there},
                              {"threads", threads},
                              {"points_open", snapshot.points_open},
                              {"points_leased", snapshot.points_leased},
                              {"points_per_s", snapshot.points_per_s},
                              {"threads_wanted", snapshot.threads_wanted()},
                              {"thread_s_per_point", snapshot.thread_s_per_point},
                              {"database_fault", snapshot.database_fault},
                              {"is_stopping", snapshot.is_stopping}};
  return overview.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace oblique::server
