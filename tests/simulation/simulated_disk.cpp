#include "tests/simulation/simulated_disk.h"

#include <algorithm>

#include "tests/simulation/world.h"

namespace oblique::simulation {

using server::AddResults;
using server::AddStudy;
using server::AddWorker;
using server::Change;
using server::SetStudyState;

void SimulatedDisk::commit(std::span<const Change> changes) {
  if (full) {
    throw server::StorageError("the disk is full");
  }
  const bool synced = std::any_of(changes.begin(), changes.end(), [](const Change& change) {
    return !std::holds_alternative<AddWorker>(change) &&
           !std::holds_alternative<AddResults>(change);
  });
  unsynced_.emplace_back();
  for (const Change& change : changes) {
    apply(change);
  }
  if (synced) {
    unsynced_.clear();
  }
}

void SimulatedDisk::apply(const Change& change) {
  if (const auto* study = std::get_if<AddStudy>(&change)) {
    contents_.studies[study->study_id] = {study->study_id,
                                          study->name,
                                          study->table,
                                          server::StudyState::kRunning,
                                          study->created_at,
                                          study->share,
                                          {},
                                          {},
                                          {}};
  } else if (const auto* state = std::get_if<SetStudyState>(&change)) {
    contents_.studies.at(state->study_id).state = state->state;
  } else if (const auto* share = std::get_if<server::SetStudyShare>(&change)) {
    contents_.studies.at(share->study_id).share = share->share;
  } else if (const auto* forget = std::get_if<server::ForgetFailures>(&change)) {
    std::erase_if(contents_.results[forget->study_id], [&](const auto& entry) {
      return forget->points.contains(entry.first) && !entry.second.error().empty();
    });
    auto& state_now = contents_.studies.at(forget->study_id).state;
    state_now = state_now == server::StudyState::kDone ? server::StudyState::kRunning : state_now;
  } else if (const auto* worker = std::get_if<AddWorker>(&change)) {
    contents_.last_worker_id = std::max(contents_.last_worker_id, worker->worker_id);
  } else if (const auto* results = std::get_if<AddResults>(&change)) {
    for (const auto& result : results->results) {
      if (!contents_.results[results->study_id].emplace(result.point(), result).second) {
        throw Violation("point " + std::to_string(result.point()) + " was stored twice");
      }
      unsynced_.back().emplace_back(results->study_id, result.point());
    }
  }
}

Found SimulatedDisk::load() const {
  Found found{{}, 0, contents_.last_worker_id};
  for (const auto& [id, study] : contents_.studies) {
    found.studies.push_back(study);
    for (const auto& [point, result] : results(id)) {
      found.studies.back().settled.insert(point);
      if (!result.error().empty()) {
        found.studies.back().failures.insert(point);
      }
    }
    found.last_study_id = std::max(found.last_study_id, id);
  }
  return found;
}

void SimulatedDisk::lose_power(std::uint64_t at_most) {
  for (; at_most > 0 && !unsynced_.empty(); --at_most) {
    for (const auto& [study_id, point] : unsynced_.back()) {
      contents_.results.at(study_id).erase(point);
    }
    unsynced_.pop_back();
  }
}

bool SimulatedDisk::has_result(std::uint64_t study_id, std::uint64_t point) const {
  return results(study_id).contains(point);
}

const server::StoredStudy* SimulatedDisk::study(const std::string& name) const {
  for (const auto& [id, study] : contents_.studies) {
    if (study.name == name) {
      return &study;
    }
  }
  return nullptr;
}

const std::map<std::uint64_t, protocol::PointResult>& SimulatedDisk::results(
    std::uint64_t study_id) const {
  static const std::map<std::uint64_t, protocol::PointResult> kNone;
  const auto found = contents_.results.find(study_id);
  return found == contents_.results.end() ? kNone : found->second;
}

}  // namespace oblique::simulation
