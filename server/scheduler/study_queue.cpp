#include "server/scheduler/study_queue.h"

#include <algorithm>

namespace oblique::server {

void StudyQueue::put(StudyId study, const Place& place) {
  const auto known = places_.find(study);
  if (known != places_.end()) {
    if (known->second == place) {
      return;
    }
    take_out(study, known->second);
    places_.erase(known);
  }
  if (place.has_free) {
    free_[place.solver_version].insert(rank_of(study, place));
    by_served_.emplace(place.served, study);
  }
  if (place.has_suspect) {
    suspects_.insert(study);
  }
  if (place.has_free || place.has_suspect) {
    places_.emplace(study, place);
  }
}

void StudyQueue::take_out(StudyId study, const Place& place) {
  if (place.has_free) {
    const auto ranks = free_.find(place.solver_version);
    ranks->second.erase(rank_of(study, place));
    if (ranks->second.empty()) {
      free_.erase(ranks);
    }
    by_served_.erase({place.served, study});
  }
  suspects_.erase(study);
}

StudyQueue::StudyId StudyQueue::next_free(const std::string& solver_version) const {
  const Rank* best = nullptr;
  for (const std::string& version : {std::string(), solver_version}) {
    const auto ranks = free_.find(version);
    if (ranks != free_.end() && (best == nullptr || *ranks->second.begin() < *best)) {
      best = &*ranks->second.begin();
    }
  }
  return best == nullptr ? 0 : std::get<StudyId>(*best);
}

std::optional<double> StudyQueue::least_served(StudyId but) const {
  for (const auto& [served, study] : by_served_) {
    if (study != but) {
      return served;
    }
  }
  return std::nullopt;
}

const StudyQueue::Place* StudyQueue::find(StudyId study) const {
  const auto found = places_.find(study);
  return found == places_.end() ? nullptr : &found->second;
}

}  // namespace oblique::server
