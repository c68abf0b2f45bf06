#pragma once

#include <cstdint>
#include <string>

#include "proto/oblique.pb.h"
#include "worker/solver/model/case_result.h"

namespace oblique::protocol {

/// What solving a point gave, but for H, mu and e, which follow from the point's number.
PointResult to_message(std::uint64_t point, const solver::CaseResult& result);

/// A failed point. An empty reason becomes "unknown".
PointResult failed_point(std::uint64_t point, const std::string& reason);

}  // namespace oblique::protocol
