#include "server/service/take_overs.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace oblique::server {
namespace {

/// Origins that a message names.
constexpr std::size_t kMostNamed = 20;

}  // namespace

bool TakeOvers::should_seek(std::uint64_t study_id, std::string_view version) const {
  const bool is_only_source = sources_.size() == 1 && sources_.contains(study_id);
  return !solver_version_.empty() && !sources_.empty() && !is_only_source &&
         (version.empty() || version == solver_version_);
}

void TakeOvers::restore(std::uint64_t study_id, const std::map<std::string, std::uint64_t>& from) {
  for (const auto& [origin, points] : from) {
    Taken& taken = taken_[study_id];
    taken.from[origin] += points;
    taken.points += points;
  }
}

bool TakeOvers::begin(std::uint64_t study_id, std::int64_t now_ms) {
  std::optional<Lookup>& lookup = taken_[study_id].lookup;
  if (lookup) {
    lookup->begins_again = true;
    lookup->is_stopped = false;
    return false;
  }
  lookup = Lookup{now_ms};
  return true;
}

std::optional<std::uint64_t> TakeOvers::add_part(std::uint64_t study_id, const ReusedResults& part,
                                                 std::int64_t now_ms) {
  restore(study_id, part.origins);
  Taken& taken = taken_.at(study_id);
  Lookup& lookup = *taken.lookup;
  if (part.points.empty()) {
    lookup.probes_in_vain += part.probes;
  } else {
    lookup.probes_in_vain = 0;
    lookup.last_result_ms = now_ms;
  }
  if (lookup.is_stopped) {
    return std::nullopt;
  }
  if (part.next_point) {
    if (lookup.probes_in_vain < kMostProbesInVain &&
        now_ms - lookup.last_result_ms < kLongestInVain_ms) {
      return part.next_point;
    }
    taken.cut_short = true;
  }
  if (lookup.begins_again) {
    lookup = Lookup{now_ms};
    return 0;
  }
  return std::nullopt;
}

void TakeOvers::cut_short(std::uint64_t study_id) {
  Taken& taken = taken_.at(study_id);
  taken.cut_short = true;
  taken.lookup->begins_again = false;
}

void TakeOvers::stop(std::uint64_t study_id) {
  if (is_under_way(study_id)) {
    taken_.at(study_id).lookup->is_stopped = true;
  }
}

bool TakeOvers::end(std::uint64_t study_id, std::int64_t now_ms) {
  Taken& taken = taken_.at(study_id);
  const bool begins_again = taken.lookup->begins_again && !taken.lookup->is_stopped;
  taken.lookup.reset();
  if (begins_again) {
    taken.lookup = Lookup{now_ms};
  } else if (taken.points == 0 && !taken.cut_short) {
    taken_.erase(study_id);
  }
  return begins_again;
}

void TakeOvers::forget(std::uint64_t study_id) {
  taken_.erase(study_id);
  sources_.erase(study_id);
}

bool TakeOvers::is_under_way(std::uint64_t study_id) const {
  const auto known = taken_.find(study_id);
  return known != taken_.end() && known->second.lookup.has_value();
}

protocol::TakenOver TakeOvers::message_of(std::uint64_t study_id) const {
  protocol::TakenOver message;
  const auto known = taken_.find(study_id);
  if (known == taken_.end()) {
    return message;
  }
  message.set_points(known->second.points);
  message.set_under_way(known->second.lookup.has_value());
  message.set_cut_short(known->second.cut_short);
  std::vector<std::pair<std::string, std::uint64_t>> from(known->second.from.begin(),
                                                          known->second.from.end());
  std::stable_sort(from.begin(), from.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  from.resize(std::min(from.size(), kMostNamed));
  for (const auto& [study, points] : from) {
    auto& part = *message.add_from();
    part.set_study(study);
    part.set_points(points);
  }
  return message;
}

std::vector<HeldReply> TakeOvers::release(std::int64_t now_ms, std::uint64_t study_id) {
  const auto waits = [&](const HeldReply& held) {
    return held.study_id != study_id && held.until_ms > now_ms && is_under_way(held.study_id);
  };
  const auto first = std::stable_partition(held_.begin(), held_.end(), waits);
  std::vector<HeldReply> released(std::make_move_iterator(first),
                                  std::make_move_iterator(held_.end()));
  held_.erase(first, held_.end());
  return released;
}

}  // namespace oblique::server
