#include "client/trace/trace_of_worker.h"

#include <algorithm>
#include <utility>

#include "proto/result_message.h"

namespace oblique::client {
namespace {

protocol::TraceRequest request_for(const std::string& study, std::uint64_t point) {
  protocol::TraceRequest request;
  request.set_study(study);
  request.set_point(point);
  return request;
}

[[noreturn]] void refuse_rows(const Connection& connection) {
  throw ConnectionError("what " + connection.url() +
                        " sends is not the rest of one trace; ask again, and should it come again, "
                        "solve it here with --here");
}

/// Gives the rows of a reply to `row`; how many there were.
std::size_t give_rows(const protocol::TraceRows& rows, const solver::TraceShape& shape,
                      const Connection& connection, const solver::Tracing::Sink& row) {
  const std::size_t count = rows.states().size();
  const std::size_t numbers = solver::trace_numbers(shape);
  if (static_cast<std::size_t>(rows.values_size()) != count * numbers) {
    refuse_rows(connection);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const auto code = static_cast<unsigned char>(rows.states()[i]);
    if (code >= solver::kTraceStates.size()) {
      refuse_rows(connection);
    }
    row(solver::trace_row(shape, {rows.values().data() + i * numbers, numbers},
                          solver::kTraceStates.at(code)));
  }
  return count;
}

SolvedByWorker solved_by_worker(const std::string& study, std::uint64_t point,
                                const protocol::TraceReply& reply) {
  SolvedByWorker solved{
      point_of(study, point, reply), reply.result().error(), std::nullopt, reply.worker(),
      reply.solver_version(),        reply.instruction_set()};
  if (solved.error.empty() && reply.outputs() == protocol::sent_outputs() &&
      protocol::fault_of(reply.result()).empty()) {
    auto& result = solved.result.emplace(protocol::from_message(reply.result()));
    result.H_m = solved.point.H_m;
    result.mu = solved.point.mu;
    result.e_star = solved.point.e_star;
    result.solver.integrator = solver::integrator_name(solved.point.model.integrator);
    result.solver.version = reply.solver_version();
  }
  return solved;
}

}  // namespace

PointAtHand point_at(Connection& connection, const std::string& study, std::uint64_t point) {
  protocol::TraceRequest request = request_for(study, point);
  request.set_only_point(true);
  return point_of(study, point, connection.trace(std::move(request)));
}

SolvedByWorker trace_by_worker(Connection& connection, const std::string& study,
                               std::uint64_t point, const TraceWishes& wishes,
                               const BeginTrace& begin, const solver::Tracing::Sink& row) {
  protocol::TraceRequest request = request_for(study, point);
  request.set_shape(wishes.with_shape);
  request.set_fall(wishes.with_fall);
  request.set_time_limit_ms(static_cast<std::uint64_t>(wishes.time_limit_ms));
  protocol::TraceReply reply = connection.trace(request);
  SolvedByWorker solved = solved_by_worker(study, point, reply);
  if (!solved.error.empty()) {
    return solved;
  }
  const auto shape = solver::trace_shape(
      solved.point.model.lengths_m.size(),
      static_cast<std::size_t>(solved.point.model.elements_per_link), wishes.with_shape);
  begin(shape);
  const std::uint64_t total = reply.total_rows();
  std::uint64_t instants = 0;  // of the contact
  const auto counted = [&](const solver::TraceRow& each) {
    instants += each.state == solver::kFalling ? 0U : 1U;
    row(each);
  };
  std::uint64_t rows = give_rows(reply.rows(), shape, connection, counted);
  while (rows < total) {
    request.set_first_row(rows);
    reply = connection.trace(request);
    const std::size_t more = give_rows(reply.rows(), shape, connection, counted);
    if (more == 0 || reply.total_rows() != total ||
        reply.solver_version() != solved.solver_version) {
      refuse_rows(connection);
    }
    rows += more;
  }
  if (solved.result && wishes.with_shape) {  // each step has an instant, and the touch
    const auto all =
        static_cast<std::uint64_t>(std::max<std::int64_t>(solved.result->solver.steps, 0)) + 1;
    solved.instants_left_out = all - std::min(all, instants);
  }
  return solved;
}

}  // namespace oblique::client
