#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "server/scheduler/scheduler_events.h"
#include "server/study/limits.h"

namespace oblique::server {

/// Most studies that are neither done nor cancelled, and points of these that are not settled.
struct StudyBounds {
  std::uint64_t studies = limits::kOpenStudies;
  std::uint64_t points = limits::kOpenPoints;
};

/// Counts studies and points that are open. Not thread-safe.
class OpenStudies {
 public:
  explicit OpenStudies(const StudyBounds& bounds) : bounds_(bounds) {}

  /// The study is open with so many open points.
  void set(StudyId study, std::uint64_t points);
  /// The same for a study that is open already; else nothing.
  void set_points(StudyId study, std::uint64_t points);
  void close(StudyId study);

  /// Why that study cannot be open with so many points, which names the bound; or an empty text.
  std::string objection_to(StudyId study, std::uint64_t points) const;

 private:
  StudyBounds bounds_;
  std::map<StudyId, std::uint64_t> points_;
  std::uint64_t all_points_ = 0;
};

}  // namespace oblique::server
