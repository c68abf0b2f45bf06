#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <utility>

#include "proto/recipe/model_message.h"
#include "server/web/page/request_flow.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::server {
namespace {

nlohmann::ordered_json columns_of(const solver::TraceShape& shape) {
  nlohmann::ordered_json columns = nlohmann::ordered_json::array();
  for (const solver::TraceColumn& column : solver::trace_columns()) {
    std::size_t count = 1;
    if (const auto* vectors = std::get_if<solver::TraceVectors>(&column.value)) {
      constexpr std::size_t kAxes = 2;
      count = kAxes * (vectors->of_links ? shape.links : shape.nodes);
    }
    const bool is_number = !std::holds_alternative<std::string solver::TraceRow::*>(column.value);
    if (is_number && count > 0) {
      columns.push_back({{"name", column.name},
                         {"unit", column.unit},
                         {"meaning", column.meaning},
                         {"numbers", count}});
    }
  }
  return columns;
}

HttpAnswer trace_answer(std::uint64_t point, bool with_shape, const protocol::TraceReply& reply) {
  const protocol::Trace& trace = reply.trace();
  const auto model = protocol::from_message(reply.model());
  const solver::TraceShape shape = solver::trace_shape(
      model.lengths_m.size(), static_cast<std::size_t>(model.elements_per_link), with_shape);
  const std::string& states = trace.states();
  std::string numbers(static_cast<std::size_t>(trace.values_size()) * sizeof(double), '\0');
  std::memcpy(numbers.data(), trace.values().data(), numbers.size());
  return numbers_answer({{"study", reply.study_id()},
                         {"point", point},
                         {"H", reply.h_m()},
                         {"mu", reply.mu()},
                         {"e", reply.e_star()},
                         {"links", shape.links},
                         {"nodes", shape.nodes},
                         {"elements_per_link", model.elements_per_link},
                         {"lengths_m", model.lengths_m},
                         {"rows", states.size()},
                         {"instants", trace.instants()},
                         {"fall_rows", std::ranges::count(states, solver::kFallingCode)},
                         {"row_numbers", solver::trace_numbers(shape)},
                         {"columns", columns_of(shape)},
                         {"states", solver::kTraceStates},
                         {"solver_version", reply.solver_version()},
                         {"instruction_set", reply.instruction_set()},
                         {"worker", reply.worker()}},
                        numbers + states);
}

}  // namespace

PendingAnswer solve_trace(ServiceClient& service, std::uint64_t study, std::uint64_t point,
                          const Fields& fields) {
  const auto is_set = [&fields](const char* name) {
    const auto field = fields.find(name);
    return field != fields.end() && field->second == "1";
  };
  const bool with_shape = is_set("shape");
  protocol::ClientRequest request;  // `every` stays 0: as many instants as fit
  request.mutable_trace()->set_point(point);
  request.mutable_trace()->set_shape(with_shape);
  request.mutable_trace()->set_fall(is_set("fall"));
  return named_study_flow(
      std::make_shared<ServiceExchange>(service), study,
      [request](const std::string& name) {
        protocol::ClientRequest named = request;
        named.mutable_trace()->set_study(name);
        return named;
      },
      [point, with_shape](const protocol::ClientReply& reply) -> NextStep {
        const std::string& error = reply.trace().trace().result().error();
        return error.empty() ? trace_answer(point, with_shape, reply.trace())
                             : error_answer(MHD_HTTP_UNPROCESSABLE_CONTENT, error);
      });
}

}  // namespace oblique::server
