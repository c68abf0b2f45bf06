#include "server/service/counts/open_studies.h"

#include <spdlog/fmt/fmt.h>

namespace oblique::server {
namespace {

/// Why `more` cannot come to `held`, which may not become more than `most`.
std::string objection_to_bound(const char* bound, const std::string& who, const char* what,
                               std::uint64_t held, std::uint64_t more, std::uint64_t most) {
  const bool fits = held <= most && more <= most - held;
  return fits ? std::string()
              : fmt::format(
                    "{} {} {} open, and the bound {} of the server is {}: wait until some are "
                    "done, or cancel some",
                    who, held, what, bound, most);
}

}  // namespace

void OpenStudies::set(StudyId study, const std::string& key, std::uint64_t points) {
  if (!studies_.contains(study)) {
    const auto share = shares_.try_emplace(key).first;
    ++share->second.studies;
    studies_.emplace(study, Study{share, 0});
  }
  set_points(study, points);
}

void OpenStudies::set_points(StudyId study, std::uint64_t points) {
  const auto found = studies_.find(study);
  if (found == studies_.end()) {
    return;
  }
  Study& open = found->second;
  open.share->second.points += points - open.points;  // modulo 2^64, and so also when it shrinks
  points_ += points - open.points;
  open.points = points;
}

void OpenStudies::close(StudyId study) {
  set_points(study, 0);
  const auto found = studies_.find(study);
  if (found == studies_.end()) {
    return;
  }
  const auto share = found->second.share;
  studies_.erase(found);
  --share->second.studies;
  if (share->second.studies == 0 && share->second.refused == 0) {
    shares_.erase(share);
  }
}

std::string OpenStudies::objection_to(StudyId study, const std::string& key,
                                      std::uint64_t points) const {
  const std::uint64_t studies = studies_.contains(study) ? 0 : 1;
  const auto first = [](std::string one, std::string other) {
    return one.empty() ? std::move(other) : std::move(one);
  };
  std::string objection = first(
      objection_to_bound("open-studies", "all have", "studies", studies_.size(), studies,
                         bounds_.studies),
      objection_to_bound("open-points", "all have", "points", points_, points, bounds_.points));
  if (key.empty() || !objection.empty()) {
    return objection;
  }
  const auto found = shares_.find(key);
  const Share share = found == shares_.end() ? Share{} : found->second;
  const std::string who = fmt::format("the key \"{}\" has", key);
  return first(objection_to_bound("open-studies-of-key", who, "studies", share.studies, studies,
                                  bounds_.studies_of_key),
               objection_to_bound("open-points-of-key", who, "points", share.points, points,
                                  bounds_.points_of_key));
}

}  // namespace oblique::server
