#include "server/service/reuse_tracker.h"

#include <algorithm>
#include <stdexcept>
#include <vector>

#include <spdlog/fmt/fmt.h>

namespace oblique::server {

void ReuseTracker::restore(StudyId id, const std::map<std::string, std::uint64_t>& origins) {
  for (const auto& [origin, points] : origins) {
    Reused& reused = reused_[id];
    reused.origins[origin] += points;
    reused.points += points;
  }
}

bool ReuseTracker::should_look_up(StudyId id, std::string_view version) const {
  const bool is_only_source = sources_.size() == 1 && sources_.contains(id);
  return !solver_version_.empty() && !sources_.empty() && !is_only_source &&
         (version.empty() || version == solver_version_);
}

void ReuseTracker::begin(StudyId id, Instant now) {
  std::optional<Lookup>& lookup = reused_[id].lookup;
  if (lookup) {
    lookup->begins_again = true;
  } else {
    lookup = Lookup{now.steady_ms};
    write_part(id, 0);
  }
}

void ReuseTracker::forget(StudyId id) {
  reused_.erase(id);
  sources_.erase(id);
}

void ReuseTracker::write_part(StudyId id, std::uint64_t first_point) {
  try {
    auto outcome = std::make_shared<ReusedResults>();
    ledger_.write(
        ReuseResults{id, states_.record(id).table.get(), first_point, solver_version_, outcome},
        [this, id, outcome](Instant now) { part_stored(id, *outcome, now); },
        [this, id](const std::string& error, Instant /*now*/) { part_refused(id, error); });
  } catch (const std::runtime_error& error) {  // only another version can read the recipe
    ports_.log(Severity::kWarning,
               fmt::format("study {}: {}", states_.record(id).name, error.what()));
    write_end(id);
  }
}

void ReuseTracker::part_stored(StudyId id, const ReusedResults& part, Instant now) {
  if (!states_.contains(id)) {
    return;  // it was deleted
  }
  const std::optional<std::uint64_t> next = next_part(id, part, now);
  if (!part.points.empty()) {
    feed_(PointsTaken{id, part.points}, now);
    add_source(id);
  }
  if (stopping_) {
    return;
  }
  if (next) {
    write_part(id, *next);
  } else {
    write_end(id);
  }
}

/// Records the part. Returns the first point of the next part; nothing: the lookup has ended.
std::optional<std::uint64_t> ReuseTracker::next_part(StudyId id, const ReusedResults& part,
                                                     Instant now) {
  restore(id, part.origins);
  Reused& reused = reused_.at(id);
  Lookup& lookup = *reused.lookup;
  if (part.points.empty()) {
    lookup.probes_in_vain += part.probes;
  } else {
    lookup.probes_in_vain = 0;
    lookup.last_result_ms = now.steady_ms;
  }
  if (states_.state(id) == StudyState::kCancelled) {
    return std::nullopt;
  }
  if (part.next_point) {
    if (lookup.probes_in_vain < kMostProbesInVain &&
        now.steady_ms - lookup.last_result_ms < kLongestInVain_ms) {
      return part.next_point;
    }
    reused.cut_short = true;
  }
  if (lookup.begins_again) {
    lookup = Lookup{now.steady_ms};
    return 0;
  }
  return std::nullopt;
}

/// The points that the lookup has not found are solved.
void ReuseTracker::part_refused(StudyId id, const std::string& error) {
  if (ledger_.is_gone() || !states_.contains(id)) {
    return;
  }
  ports_.log(Severity::kWarning,
             fmt::format("study {}: results of other studies cannot be reused: {}",
                         states_.record(id).name, error));
  Reused& reused = reused_.at(id);
  reused.cut_short = true;
  reused.lookup->begins_again = false;
  write_end(id);
}

void ReuseTracker::write_end(StudyId id) {
  ledger_.write(EndReuse{id}, [this, id](Instant now) { end_stored(id, now); });
}

void ReuseTracker::end_stored(StudyId id, Instant now) {
  if (!states_.contains(id)) {
    return;
  }
  Reused& reused = reused_.at(id);
  if (reused.lookup->begins_again && states_.state(id) != StudyState::kCancelled) {
    reused.lookup = Lookup{now.steady_ms};
    write_part(id, 0);
    return;
  }
  reused.lookup.reset();
  if (reused.points > 0) {
    std::string origins;
    for (const auto& [study, points] : reused.origins) {
      origins += fmt::format("{}{} of {}", origins.empty() ? "" : ", ", points, study);
    }
    ports_.log(Severity::kInfo, fmt::format("study {} reuses {} results: {}",
                                            states_.record(id).name, reused.points, origins));
  } else if (!reused.cut_short) {
    reused_.erase(id);
  }
  feed_(StudyHeld{id, false}, now);
  on_end_(now);
}

bool ReuseTracker::is_under_way(StudyId id) const {
  const auto known = reused_.find(id);
  return known != reused_.end() && known->second.lookup.has_value();
}

protocol::TakenOver ReuseTracker::status(StudyId id) const {
  constexpr std::size_t kMostOrigins = 20;
  protocol::TakenOver message;
  const auto known = reused_.find(id);
  if (known == reused_.end()) {
    return message;
  }
  const Reused& reused = known->second;
  message.set_points(reused.points);
  message.set_under_way(reused.lookup.has_value());
  message.set_cut_short(reused.cut_short);
  std::vector<std::pair<std::string, std::uint64_t>> origins(reused.origins.begin(),
                                                             reused.origins.end());
  std::ranges::stable_sort(origins, std::ranges::greater(),
                           [](const auto& origin) { return origin.second; });
  origins.resize(std::min(origins.size(), kMostOrigins));
  for (const auto& [study, points] : origins) {
    auto& origin = *message.add_from();
    origin.set_study(study);
    origin.set_points(points);
  }
  return message;
}

}  // namespace oblique::server
