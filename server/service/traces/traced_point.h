#pragma once

#include <cstdint>
#include <string>

#include "proto/oblique.pb.h"
#include "proto/recipe/point_table.h"

namespace oblique::server {

/// One point of a study, with all that solving it needs.
struct TracedPoint {
  protocol::ModelParameters model;
  double H_m = 0.0;
  double mu = 0.0;
  double e_star = 0.0;
  bool errors = false;    ///< its study wants estimated errors
  std::string objection;  ///< why there is no such point; empty: there is
};

TracedPoint traced_point(const protocol::PointTable& table, std::uint64_t point);
/// The reply that says what the point is, and nothing of its trace.
protocol::TraceReply said_of(const TracedPoint& point);
/// The same for a recipe that is parsed first; an objection when it cannot be.
TracedPoint traced_point(const std::string& recipe_bytes, std::uint64_t point);

}  // namespace oblique::server
