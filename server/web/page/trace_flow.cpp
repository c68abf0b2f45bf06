#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <utility>

#include "proto/recipe/model_message.h"
#include "proto/result_message.h"
#include "server/web/page/request_flow.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::server {
namespace {

/// A trace that comes in parts.
struct ComingTrace {
  protocol::ClientRequest request;  ///< for the next part
  protocol::TraceReply reply;       ///< with the rows so far
};

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

HttpAnswer trace_answer(std::uint64_t point, bool with_shape, const protocol::TraceReply& trace) {
  const auto model = protocol::from_message(trace.model());
  const solver::TraceShape shape = solver::trace_shape(
      model.lengths_m.size(), static_cast<std::size_t>(model.elements_per_link), with_shape);
  const auto& values = trace.rows().values();
  const std::string& states = trace.rows().states();
  std::string numbers(static_cast<std::size_t>(values.size()) * sizeof(double), '\0');
  std::memcpy(numbers.data(), values.data(), numbers.size());
  return numbers_answer({{"study", trace.study_id()},
                         {"point", point},
                         {"H", trace.h_m()},
                         {"mu", trace.mu()},
                         {"e", trace.e_star()},
                         {"links", shape.links},
                         {"nodes", shape.nodes},
                         {"elements_per_link", model.elements_per_link},
                         {"lengths_m", model.lengths_m},
                         {"rows", states.size()},
                         {"instants", protocol::from_message(trace.result()).solver.steps + 1},
                         {"fall_rows", std::ranges::count(states, solver::kFallingCode)},
                         {"row_numbers", solver::trace_numbers(shape)},
                         {"columns", columns_of(shape)},
                         {"states", solver::kTraceStates},
                         {"solver_version", trace.solver_version()},
                         {"instruction_set", trace.instruction_set()},
                         {"worker", trace.worker()}},
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
  const auto trace = std::make_shared<ComingTrace>();
  protocol::TraceRequest& request = *trace->request.mutable_trace();
  request.set_point(point);
  request.set_shape(with_shape);
  request.set_fall(is_set("fall"));
  return named_study_flow(
      std::make_shared<ServiceExchange>(service), study,
      [trace](const std::string& name) {
        trace->request.mutable_trace()->set_study(name);
        return trace->request;
      },
      [trace, point, with_shape](const protocol::ClientReply& reply) -> NextStep {
        const protocol::TraceReply& part = reply.trace();
        if (!part.result().error().empty()) {
          return error_answer(MHD_HTTP_UNPROCESSABLE_CONTENT, part.result().error());
        }
        protocol::TraceReply& whole = trace->reply;
        const std::string states = whole.rows().states() + part.rows().states();
        if (whole.rows().states().empty()) {
          whole = part;
        } else {
          whole.mutable_rows()->mutable_values()->MergeFrom(part.rows().values());
          whole.mutable_rows()->set_states(states);
        }
        if (part.rows().states().empty() || states.size() >= part.total_rows()) {
          return trace_answer(point, with_shape, whole);
        }
        trace->request.mutable_trace()->set_first_row(states.size());
        return trace->request;
      });
}

}  // namespace oblique::server
