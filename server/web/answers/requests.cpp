#include "server/web/answers/study_answers.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "proto/recipe/model_message.h"
#include "proto/text.h"
#include "proto/wire/chunk.h"
#include "server/study/limits.h"
#include "server/web/status/snapshot.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::server {
namespace {

using nlohmann::ordered_json;
using protocol::ClientReply;
using protocol::ClientRequest;

constexpr std::uint64_t kMaxLines = 1000;
constexpr std::uint64_t kUsualRows = 200;
constexpr std::uint64_t kMaxRows = 100'000;

std::uint32_t lines_of(const Fields& fields) {
  return static_cast<std::uint32_t>(std::clamp<std::uint64_t>(
      FieldReader(fields).whole("limit").value_or(kMaxLines), 1, kMaxLines));
}

ordered_json json_of(const protocol::Cell& cell) {
  switch (cell.kind) {
    case protocol::CellKind::kInteger:
      return cell.integer;
    case protocol::CellKind::kReal:
      return cell.real;
    case protocol::CellKind::kText:
      return std::string(cell.text);
    case protocol::CellKind::kNull:
      break;
  }
  return nullptr;
}

/// Formats a line of CSV. NULL is an empty field, but `""` on its own, because readers skip empty
/// lines.
std::string csv_line(const ordered_json& values) {
  std::string line;
  for (const ordered_json& value : values) {
    line += &value == &values.front() ? "" : ",";
    if (value.is_string()) {
      protocol::append_csv_field(line, value.get_ref<const std::string&>());
    } else if (!value.is_null()) {
      line += value.dump();
    }
  }
  return (line.empty() ? "\"\"" : line) + "\r\n";
}

class RowStream {
 public:
  RowStream(std::shared_ptr<ServiceExchange> exchange, bool as_csv)
      : exchange_(std::move(exchange)), as_csv_(as_csv) {}

  void begin(const protocol::QueryReply& chunk) {
    const ordered_json columns(
        std::vector<std::string>(chunk.columns().begin(), chunk.columns().end()));
    const ordered_json units(std::vector<std::string>(chunk.units().begin(), chunk.units().end()));
    text_ = as_csv_ ? csv_line(columns)
                    : "{\"columns\":" + json_text(columns) + ",\"units\":" + json_text(units) +
                          ",\"rows\":[";
    take(chunk);
  }
  std::optional<std::string> next() {
    if (text_.empty() && !has_ended_) {
      if (const auto reply = exchange_->reply()) {
        if (reply->has_error()) {
          throw std::runtime_error(reply->error().message());
        }
        take(reply->query());
      }
    }
    return text_.empty() && has_ended_ ? std::nullopt : std::optional(std::exchange(text_, {}));
  }

 private:
  void take(const protocol::QueryReply& chunk) {
    if (!protocol::is_sound(chunk)) {
      throw std::runtime_error("a reader process of the server sent an invalid answer");
    }
    for (protocol::ChunkRows rows(chunk); rows.next(); ++rows_) {
      ordered_json values = ordered_json::array();
      for (std::size_t i = 0; i < rows.columns(); ++i) {
        values.push_back(json_of(rows.cell(i)));
      }
      text_ += as_csv_ ? csv_line(values) : (rows_ == 0 ? "" : ",\n") + json_text(values);
    }
    has_ended_ = chunk.ends();
    if (!has_ended_) {
      exchange_->request_more_rows();
    } else if (!as_csv_) {
      text_ += "]}\n";
    }
  }

  std::shared_ptr<ServiceExchange> exchange_;
  bool as_csv_;
  std::string text_;  // text that was not sent yet
  std::uint64_t rows_ = 0;
  bool has_ended_ = false;
};

ordered_json columns_of(const solver::TraceShape& shape) {
  ordered_json columns = ordered_json::array();
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

using NextStep = std::variant<HttpAnswer, ClientRequest>;
using OnReply = std::function<NextStep(const ClientReply&)>;

/// Sends requests to the service one after another until there is an answer. An error of the
/// service becomes the answer.
PendingAnswer request_flow(std::shared_ptr<ServiceExchange> exchange, const ClientRequest& first,
                           OnReply on_reply) {
  exchange->send(first);
  return [exchange = std::move(exchange),
          on_reply = std::move(on_reply)]() -> std::optional<HttpAnswer> {
    while (const auto reply = exchange->reply()) {
      NextStep next = reply->has_error() ? failure(reply->error()) : on_reply(*reply);
      if (auto* const answer = std::get_if<HttpAnswer>(&next)) {
        return std::move(*answer);
      }
      exchange->send(std::get<ClientRequest>(next));
    }
    return std::nullopt;
  };
}

/// Sends requests about a study until there is an answer. HTTP requests contain the study's number,
/// most requests to the service its name. `request` returns the request for a name.
PendingAnswer named_study_flow(std::shared_ptr<ServiceExchange> exchange, std::uint64_t study,
                               std::function<ClientRequest(const std::string&)> request,
                               OnReply on_reply) {
  ClientRequest first;
  first.mutable_status()->set_study_id(study);
  return request_flow(std::move(exchange), first,
                      [request = std::move(request),
                       on_reply = std::move(on_reply)](const ClientReply& reply) -> NextStep {
                        return reply.has_status() ? request(reply.status().studies(0).name())
                                                  : on_reply(reply);
                      });
}

}  // namespace

PendingAnswer list_studies(ServiceClient& service, const Fields& fields) {
  ClientRequest request;
  request.mutable_status()->set_after_study_id(FieldReader(fields).whole("after").value_or(0));
  request.mutable_status()->set_limit(lines_of(fields));
  return request_flow(
      std::make_shared<ServiceExchange>(service), request,
      [](const ClientReply& reply) -> NextStep {
        return json_answer({{"studies", json_list(reply.status().studies(), study_json)},
                            {"next_after", reply.status().next_after()}});
      });
}

PendingAnswer list_workers(ServiceClient& service, const Fields& fields) {
  ClientRequest request;
  request.mutable_workers()->set_after_worker_id(FieldReader(fields).whole("after").value_or(0));
  request.mutable_workers()->set_limit(lines_of(fields));
  return request_flow(
      std::make_shared<ServiceExchange>(service), request,
      [](const ClientReply& reply) -> NextStep {
        return json_answer({{"workers", json_list(reply.workers().workers(), worker_json)},
                            {"next_after", reply.workers().next_after()}});
      });
}

PendingAnswer query_rows(ServiceClient& service, std::uint64_t study, const Fields& fields) {
  const FieldReader reader(fields);
  const std::string format = reader.text("format").value_or("json");
  if (format != "json" && format != "csv") {
    throw std::invalid_argument("format must be json or csv");
  }
  ClientRequest request;
  protocol::StudyQuery& query = *request.mutable_query()->mutable_question();
  query.set_where(reader.text("where").value_or(""));
  query.set_group(reader.text("group").value_or(""));
  query.set_order(reader.text("order").value_or(""));
  if (const auto select = reader.text("select")) {
    query.add_select(*select);
  }
  query.set_limit(std::min(reader.whole("limit").value_or(kUsualRows), kMaxRows));
  const auto exchange = std::make_shared<ServiceExchange>(service);
  const bool as_csv = format == "csv";
  return named_study_flow(
      exchange, study,
      [request](const std::string& name) mutable {
        request.mutable_query()->mutable_question()->set_study(name);
        return request;
      },
      [exchange, as_csv](const ClientReply& reply) -> NextStep {
        const auto rows = std::make_shared<RowStream>(exchange, as_csv);
        rows->begin(reply.query());
        HttpAnswer answer{MHD_HTTP_OK, as_csv ? "text/csv; charset=utf-8" : "application/json", {}};
        if (as_csv) {
          answer.headers = {{"Content-Disposition", "attachment; filename=\"rows.csv\""}};
        }
        answer.stream = [rows] { return rows->next(); };
        return answer;
      });
}

PendingAnswer submit_study(ServiceClient& service, const std::string& body) {
  ClientRequest request;
  *request.mutable_submit() = study_of_body(body);
  return request_flow(std::make_shared<ServiceExchange>(service), request,
                      [](const ClientReply& reply) -> NextStep {
                        const protocol::SubmitReply& submitted = reply.submit();
                        return json_answer({{"id", submitted.study_id()},
                                            {"points", submitted.points()},
                                            {"settled", submitted.completed()},
                                            {"created", submitted.created()},
                                            {"appended", submitted.appended()},
                                            {"taken", submitted.reused().points()}});
                      });
}

std::optional<protocol::StudyChange> study_change(std::string_view name) {
  static const std::map<std::string_view, protocol::StudyChange> kChanges{
      {"pause", protocol::STUDY_CHANGE_PAUSE},
      {"resume", protocol::STUDY_CHANGE_RESUME},
      {"cancel", protocol::STUDY_CHANGE_CANCEL},
      {"retry", protocol::STUDY_CHANGE_RETRY}};
  const auto found = kChanges.find(name);
  return found == kChanges.end() ? std::nullopt : std::optional(found->second);
}

PendingAnswer change_study(ServiceClient& service, std::uint64_t study,
                           protocol::StudyChange change) {
  return named_study_flow(
      std::make_shared<ServiceExchange>(service), study,
      [change](const std::string& name) {
        ClientRequest request;
        request.mutable_change()->set_study(name);
        request.mutable_change()->set_change(change);
        return request;
      },
      [](const ClientReply& reply) -> NextStep {
        return json_answer(
            {{"study", study_json(reply.change().study())}, {"retried", reply.change().retried()}});
      });
}

PendingAnswer solve_trace(ServiceClient& service, std::uint64_t study, std::uint64_t point,
                          const Fields& fields) {
  const auto is_set = [&fields](const char* name) {
    return FieldReader(fields).text(name).value_or("") == "1";
  };
  const bool with_shape = is_set("shape");
  ClientRequest request;  // without `every`, the trace has as many instants as fit
  request.mutable_trace()->set_point(point);
  request.mutable_trace()->set_shape(with_shape);
  request.mutable_trace()->set_fall(is_set("fall"));
  const auto until = FlowClock::now() + std::chrono::milliseconds(limits::kTraceTime_ms);
  return [&service, study, point, with_shape, request, until,
          flow = PendingAnswer()]() mutable -> std::optional<HttpAnswer> {
    const auto slot = flow ? nullptr : service.trace_slots().take();
    if (!flow && !slot) {
      return FlowClock::now() < until
                 ? std::nullopt
                 : std::optional(
                       error_answer(MHD_HTTP_SERVICE_UNAVAILABLE,
                                    "too many traces are being sent to browsers: try again later"));
    }
    if (slot) {
      flow = named_study_flow(
          std::make_shared<ServiceExchange>(service), study,
          [request](const std::string& name) mutable {
            request.mutable_trace()->set_study(name);
            return request;
          },
          [point, with_shape, slot](const ClientReply& reply) -> NextStep {
            const std::string& error = reply.trace().trace().result().error();
            HttpAnswer answer = error.empty() ? trace_answer(point, with_shape, reply.trace())
                                              : error_answer(MHD_HTTP_UNPROCESSABLE_CONTENT, error);
            answer.until_sent = slot;
            return answer;
          });
    }
    return flow();
  };
}

}  // namespace oblique::server
