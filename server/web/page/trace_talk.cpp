#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "proto/recipe/model_message.h"
#include "proto/result_message.h"
#include "server/web/http/json_answer.h"
#include "server/web/page/talks.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::server {
namespace {

constexpr unsigned kAcceptedForLater = 202;
constexpr unsigned kNoStudy = 404;
constexpr unsigned kUnprocessable = 422;

/// A trace as it comes, reply by reply.
struct ComingTrace {
  std::string study;
  std::uint64_t point;
  bool shape;
  bool fall;
  protocol::TraceReply head;
  std::vector<double> values{};
  std::string states{};
};

protocol::ClientRequest trace_request(const ComingTrace& trace) {
  protocol::ClientRequest request;
  auto& asked = *request.mutable_trace();
  asked.set_study(trace.study);
  asked.set_point(trace.point);
  asked.set_shape(trace.shape);
  asked.set_fall(trace.fall);
  asked.set_first_row(trace.states.size());
  return request;
}

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

HttpAnswer whole(const ComingTrace& trace) {
  const auto model = protocol::from_message(trace.head.model());
  const solver::TraceShape shape = solver::trace_shape(
      model.lengths_m.size(), static_cast<std::size_t>(model.elements_per_link), trace.shape);
  std::string numbers(trace.values.size() * sizeof(double), '\0');
  std::memcpy(numbers.data(), trace.values.data(), numbers.size());
  numbers += trace.states;
  return numbers_answer({{"study", trace.head.study_id()},
                         {"point", trace.point},
                         {"H", trace.head.h_m()},
                         {"mu", trace.head.mu()},
                         {"e", trace.head.e_star()},
                         {"links", shape.links},
                         {"nodes", shape.nodes},
                         {"elements_per_link", model.elements_per_link},
                         {"lengths_m", model.lengths_m},
                         {"rows", trace.states.size()},
                         {"instants", protocol::from_message(trace.head.result()).solver.steps + 1},
                         {"fall_rows", std::ranges::count(trace.states, solver::kFallingCode)},
                         {"row_numbers", solver::trace_numbers(shape)},
                         {"columns", columns_of(shape)},
                         {"states", solver::kTraceStates},
                         {"solver_version", trace.head.solver_version()},
                         {"instruction_set", trace.head.instruction_set()},
                         {"worker", trace.head.worker()}},
                        numbers);
}

}  // namespace

Talk trace_talk(std::uint64_t study, std::uint64_t point, const HttpQuestion& question) {
  const auto is_asked_for = [&question](const char* name) {
    const auto field = question.fields.find(name);
    return field != question.fields.end() && field->second == "1";
  };
  auto trace = std::make_shared<ComingTrace>();
  trace->point = point;
  trace->shape = is_asked_for("shape");
  trace->fall = is_asked_for("fall");
  protocol::ClientRequest first;
  first.mutable_status()->set_study_id(study);
  return {
      first,
      [trace](const protocol::ClientReply& reply) -> Talk::Next {
        if (reply.has_status() && reply.status().studies_size() != 1) {
          return error_answer(kNoStudy, "there is no such study");
        }
        if (reply.has_status()) {
          trace->study = reply.status().studies(0).name();
          return trace_request(*trace);
        }
        const protocol::TraceReply& part = reply.trace();
        if (trace->states.empty()) {
          trace->head = part;
          trace->head.clear_rows();
        }
        if (!part.result().error().empty()) {
          return error_answer(kUnprocessable, part.result().error());
        }
        trace->values.insert(trace->values.end(), part.rows().values().begin(),
                             part.rows().values().end());
        trace->states += part.rows().states();
        const bool is_whole =
            part.rows().states().empty() || trace->states.size() >= part.total_rows();
        return is_whole ? Talk::Next(whole(*trace)) : Talk::Next(trace_request(*trace));
      },
      json_answer({{"state", "a worker is waited for, or at work: ask again"}}, kAcceptedForLater)};
}

}  // namespace oblique::server
