#include <algorithm>
#include <cstdint>
#include <cstring>
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

bool has_flag(const HttpQuestion& question, const char* name) {
  const auto field = question.fields.find(name);
  return field != question.fields.end() && field->second == "1";
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

HttpAnswer answer_of(const protocol::TraceReply& reply, std::uint64_t point, bool has_shape) {
  const protocol::Trace& trace = reply.trace();
  const auto model = protocol::from_message(reply.model());
  const solver::TraceShape shape = solver::trace_shape(
      model.lengths_m.size(), static_cast<std::size_t>(model.elements_per_link), has_shape);
  std::string numbers(static_cast<std::size_t>(trace.values_size()) * sizeof(double), '\0');
  std::memcpy(numbers.data(), trace.values().data(), numbers.size());
  numbers += trace.states();
  return numbers_answer({{"study", reply.study_id()},
                         {"point", point},
                         {"H", reply.h_m()},
                         {"mu", reply.mu()},
                         {"e", reply.e_star()},
                         {"links", shape.links},
                         {"nodes", shape.nodes},
                         {"elements_per_link", model.elements_per_link},
                         {"lengths_m", model.lengths_m},
                         {"rows", trace.states().size()},
                         {"instants", trace.instants()},
                         {"fall_rows", std::ranges::count(trace.states(), solver::kFallingCode)},
                         {"row_numbers", solver::trace_numbers(shape)},
                         {"columns", columns_of(shape)},
                         {"states", solver::kTraceStates},
                         {"solver_version", reply.solver_version()},
                         {"instruction_set", reply.instruction_set()},
                         {"worker", reply.worker()}},
                        numbers);
}

}  // namespace

Talk trace_talk(std::uint64_t study, std::uint64_t point, const HttpQuestion& question) {
  protocol::ClientRequest first;
  first.mutable_status()->set_study_id(study);
  protocol::ClientRequest second;  // `every` stays 0: as many instants as fit
  second.mutable_trace()->set_point(point);
  second.mutable_trace()->set_shape(has_flag(question, "shape"));
  second.mutable_trace()->set_fall(has_flag(question, "fall"));
  return {
      first,
      [second](const protocol::ClientReply& reply) -> Talk::Next {
        if (reply.has_status() && reply.status().studies_size() != 1) {
          return error_answer(kNoStudy, "there is no such study");
        }
        if (reply.has_status()) {
          protocol::ClientRequest request = second;
          request.mutable_trace()->set_study(reply.status().studies(0).name());
          return request;
        }
        const protocol::TraceReply& trace = reply.trace();
        const std::string& error = trace.trace().result().error();
        return error.empty() ? answer_of(trace, second.trace().point(), second.trace().shape())
                             : error_answer(kUnprocessable, error);
      },
      json_answer({{"state", "a worker is waited for, or at work: ask again"}}, kAcceptedForLater)};
}

}  // namespace oblique::server
