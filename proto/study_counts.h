#pragma once

#include <cstdint>

#include "proto/oblique.pb.h"

namespace oblique::protocol {

/// Points of a study that are solved, failed or left out by a filter.
inline std::uint64_t completed_points(const StudyStatus& study) {
  return study.solved() + study.failed() + study.left_out();
}

/// The others. The filter may still leave out some of them.
inline std::uint64_t open_points(const StudyStatus& study) {
  return study.points() - completed_points(study);
}

}  // namespace oblique::protocol
