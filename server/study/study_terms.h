#pragma once

#include <cstdint>

namespace oblique::server {

/// How the scheduler treats a study. Studies of a higher priority come first, and those of one
/// priority share the workers by weight.
struct StudyTerms {
  std::int32_t priority = 0;
  double weight = 1.0;
  /// Workers of any solver version take part, not only of the one that the study began with.
  bool mixes_versions = false;

  bool operator==(const StudyTerms&) const = default;
};

}  // namespace oblique::server
