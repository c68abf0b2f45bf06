#include "client/trace/worker_trace.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <stdexcept>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "proto/result_message.h"
#include "server/maintenance/study_changes_offline.h"

namespace oblique::client {
namespace {

PointSpec point_of(const std::string& study, std::uint64_t point,
                   const protocol::TraceReply& reply) {
  return {study,         point,      protocol::from_message(reply.model()),
          reply.h_m(),   reply.mu(), reply.e_star(),
          reply.errors()};
}

}  // namespace

PointSpec point_in(const std::string& database, const protocol::StudyStatus& study,
                   std::uint64_t point) {
  const protocol::PointTable table(server::stored_recipe(database, study.study_id()));
  if (point >= table.size()) {
    throw std::runtime_error(fmt::format("the study \"{}\" has no point {}: its points are 0 to {}",
                                         study.name(), point, table.size() - 1));
  }
  if (!table.is_left_in(point)) {
    throw std::runtime_error(
        fmt::format("point {} of the study \"{}\" is left out by its filter", point, study.name()));
  }
  if (const std::string fault = table.fault(point); !fault.empty()) {
    throw std::runtime_error(fault);
  }
  const protocol::Point values = table.point(point);
  return {study.name(), point,         table.model(values.model), values.H_m,
          values.mu,    values.e_star, table.wants_errors()};
}

PointSpec point_at(Connection& connection, const std::string& study, std::uint64_t point) {
  protocol::TraceRequest request;
  request.set_study(study);
  request.set_point(point);
  request.set_only_point(true);
  return point_of(study, point, connection.trace(std::move(request)));
}

SolvedByWorker trace_by_worker(Connection& connection, const std::string& study,
                               std::uint64_t point, const TraceOptions& options,
                               const std::function<void(const solver::TraceShape&)>& begin,
                               const solver::Tracing::Sink& row) {
  protocol::TraceRequest request;
  request.set_study(study);
  request.set_point(point);
  request.set_shape(options.with_shape);
  request.set_fall(options.with_fall);
  request.set_every(options.every);
  request.set_time_limit_ms(static_cast<std::uint64_t>(options.time_limit_ms));
  const protocol::TraceReply reply = connection.trace(request);
  const protocol::Trace& trace = reply.trace();
  SolvedByWorker solved{.point = point_of(study, point, reply),
                        .error = trace.result().error(),
                        .worker = reply.worker(),
                        .instruction_set = reply.instruction_set(),
                        .every = trace.every()};
  if (!solved.error.empty()) {
    return solved;
  }
  const PointSpec& spec = solved.point;
  if (reply.outputs() == protocol::sent_outputs()) {
    auto& result = solved.result.emplace(protocol::from_message(trace.result()));
    result.H_m = spec.H_m;
    result.mu = spec.mu;
    result.e_star = spec.e_star;
    result.solver.integrator = solver::integrator_name(spec.model.integrator);
    result.solver.version = reply.solver_version();
  }
  const auto shape = solver::trace_shape(spec.model.lengths_m.size(),
                                         static_cast<std::size_t>(spec.model.elements_per_link),
                                         options.with_shape);
  if (const std::string fault = protocol::fault_of_trace(trace, shape, options.with_fall);
      !fault.empty()) {
    throw ConnectionError(
        fmt::format("what {} sent is no trace: {}; --local solves the point in this process",
                    connection.url(), fault));
  }
  if (trace.states().empty()) {
    const std::string every =
        trace.every() > trace.instants()
            ? std::string()
            : fmt::format("--every {} gives one in {} and all ends of phases, ", trace.every(),
                          trace.every());
    throw ServerError(fmt::format(
        "the trace has {} instants, more than one message of a server can hold: {}--local solves "
        "the point in this process and gives all",
        trace.instants(), every));
  }
  begin(shape);
  const std::size_t numbers = solver::trace_numbers(shape);
  for (std::size_t i = 0; i < trace.states().size(); ++i) {
    row(solver::trace_row(shape, {trace.values().data() + i * numbers, numbers},
                          solver::kTraceStates.at(static_cast<unsigned char>(trace.states()[i]))));
  }
  return solved;
}

std::vector<solver::TraceRow> take_fall(std::vector<solver::TraceRow>& rows) {
  const auto touch = std::find_if(rows.begin(), rows.end(), [](const solver::TraceRow& row) {
    return row.state != solver::kFalling;
  });
  std::vector<solver::TraceRow> fall(std::make_move_iterator(rows.begin()),
                                     std::make_move_iterator(touch));
  rows.erase(rows.begin(), touch);
  return fall;
}

}  // namespace oblique::client
