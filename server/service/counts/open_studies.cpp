#include "server/service/counts/open_studies.h"

#include <spdlog/fmt/fmt.h>

namespace oblique::server {

void OpenStudies::set(StudyId study, std::uint64_t points) {
  points_.try_emplace(study, 0);
  set_points(study, points);
}

void OpenStudies::set_points(StudyId study, std::uint64_t points) {
  if (const auto found = points_.find(study); found != points_.end()) {
    all_points_ += points - found->second;  // modulo 2^64, so also when they become fewer
    found->second = points;
  }
}

void OpenStudies::close(StudyId study) {
  set_points(study, 0);
  points_.erase(study);
}

std::string OpenStudies::objection_to(StudyId study, std::uint64_t points) const {
  if (points_.size() >= bounds_.studies && !points_.contains(study)) {
    return fmt::format(
        "{} studies are open, and the server takes no more: wait until some are done, or cancel "
        "some",
        points_.size());
  }
  const auto known = points_.find(study);
  const std::uint64_t others = all_points_ - (known == points_.end() ? 0 : known->second);
  return others <= bounds_.points && points <= bounds_.points - others
             ? std::string()
             : fmt::format(
                   "the open studies would have more than {} points without a result "
                   "(--limits-open-points of the server): wait until some are done, or cancel some",
                   bounds_.points);
}

}  // namespace oblique::server
