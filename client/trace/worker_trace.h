#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/service/connection.h"
#include "proto/oblique.pb.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::client {

/// A point of a study, with all that solving it needs.
struct PointSpec {
  std::string study;
  std::uint64_t point = 0;
  solver::ModelParameters model;
  double H_m = 0.0;
  double mu = 0.0;
  double e_star = 0.0;
  bool errors = false;  ///< its study has estimated errors
};

/// The point by the recipe in a database file. Throws as server::stored_recipe does, and
/// std::runtime_error for a point that the study does not have.
PointSpec point_in(const std::string& database, const protocol::StudyStatus& study,
                   std::uint64_t point);

/// The point as a server returns it; nothing is solved.
PointSpec point_at(Connection& connection, const std::string& study, std::uint64_t point);

/// The answer of a worker.
struct SolvedByWorker {
  PointSpec point;
  std::string error;                              ///< why there is no result; empty: there is one
  std::optional<solver::CaseResult> result = {};  ///< none: it has outputs that are unknown here
  std::string worker;                             ///< its name
  std::string instruction_set;
  std::uint64_t every = 1;  ///< the rows have each such instant of the contact
};

struct TraceOptions {
  bool with_shape = false;
  bool with_fall = false;
  std::uint64_t every = 1;         ///< each such instant and all ends of phases; 0: as many as fit
  std::int64_t time_limit_ms = 0;  ///< 0: the server's own
};

/// Has a worker solve the point and passes the shape of its trace to `begin` and its instants to
/// `row`. Throws what the connection throws, ServerError for a trace that is too long, and
/// ConnectionError for a reply that is no trace.
SolvedByWorker trace_by_worker(Connection& connection, const std::string& study,
                               std::uint64_t point, const TraceOptions& options,
                               const std::function<void(const solver::TraceShape&)>& begin,
                               const solver::Tracing::Sink& row);

/// Moves the rows of the fall out of a trace: from release (its time is minus the time of the fall)
/// to touch. The contact is left.
std::vector<solver::TraceRow> take_fall(std::vector<solver::TraceRow>& rows);

}  // namespace oblique::client
