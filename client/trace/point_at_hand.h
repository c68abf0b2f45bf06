#pragma once

#include <cstdint>
#include <string>

#include "proto/oblique.pb.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// A point of a study, with all that solving it needs.
struct PointAtHand {
  std::string study;
  std::uint64_t point = 0;
  solver::ModelParameters model;
  double H_m = 0.0;
  double mu = 0.0;
  double e_star = 0.0;
  bool errors = false;  ///< its study wants estimated errors
};

/// The point as the recipe in a database file says. Throws as server::stored_recipe does, and
/// std::runtime_error for a point that the study does not have.
PointAtHand point_in(const std::string& database, const protocol::StudyStatus& study,
                     std::uint64_t point);

/// The point as a server says.
PointAtHand point_of(const std::string& study, std::uint64_t point,
                     const protocol::TraceReply& reply);

}  // namespace oblique::client
