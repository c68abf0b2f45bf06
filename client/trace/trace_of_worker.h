#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "client/service/connection.h"
#include "client/trace/point_at_hand.h"
#include "proto/oblique.pb.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::client {

/// What a worker said of a point.
struct SolvedByWorker {
  PointAtHand point;
  std::string error;                         ///< why it has no answer; empty: it has
  std::optional<solver::CaseResult> result;  ///< none: it has outputs that are unknown here
  std::string worker;                        ///< its name
  std::string solver_version;
  std::string instruction_set;
  std::uint64_t every = 1;  ///< the rows have each such instant of the contact
};

/// What is wanted of a trace.
struct TraceWishes {
  bool with_shape = false;
  bool with_fall = false;
  std::uint64_t every = 1;         ///< each such instant and all ends of phases; 0: as many as fit
  std::int64_t time_limit_ms = 0;  ///< 0: the server's own
};

/// Gets the shape of a trace, before its first row.
using BeginTrace = std::function<void(const solver::TraceShape&)>;

/// What the point is, as the server says; nothing is solved.
PointAtHand point_at(Connection& connection, const std::string& study, std::uint64_t point);

/// Has a worker solve the point and passes its instants to `row`. Throws what the connection
/// throws, ServerError for a trace that is too long, and ConnectionError for a reply that is no
/// trace.
SolvedByWorker trace_by_worker(Connection& connection, const std::string& study,
                               std::uint64_t point, const TraceWishes& wishes,
                               const BeginTrace& begin, const solver::Tracing::Sink& row);

}  // namespace oblique::client
