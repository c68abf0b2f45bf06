#include "server/web/page/request_flow.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include "proto/wire/chunk.h"
#include "server/web/answers/study_answers.h"
#include "server/web/status/status_json.h"

namespace oblique::server {
namespace {

using nlohmann::ordered_json;
using protocol::ClientReply;
using protocol::ClientRequest;

constexpr std::uint64_t kMostLines = 1000;
constexpr std::uint64_t kUsualRows = 200;
constexpr std::uint64_t kMostRows = 100'000;

std::uint32_t lines_of(const Fields& fields) {
  return static_cast<std::uint32_t>(std::clamp<std::uint64_t>(
      FieldReader(fields).whole("limit").value_or(kMostLines), 1, kMostLines));
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

/// As RFC 4180 has it; NULL is an empty field.
std::string csv_field(const ordered_json& value) {
  if (!value.is_string()) {
    return value.is_null() ? std::string() : value.dump();
  }
  const auto& text = value.get_ref<const std::string&>();
  if (text.find_first_of("\",\r\n") == std::string::npos) {
    return text;
  }
  std::string quoted = "\"";
  for (const char c : text) {
    quoted += c == '"' ? "\"\"" : std::string(1, c);
  }
  return quoted + '"';
}

std::string csv_line(const ordered_json& values) {
  std::string fields;
  for (const ordered_json& value : values) {
    fields += (&value == &values.front() ? "" : ",") + csv_field(value);
  }
  return fields + "\r\n";
}

/// The rows of a query, sent on chunk by chunk.
class RowStream {
 public:
  RowStream(std::shared_ptr<ServiceExchange> exchange, bool as_csv)
      : exchange_(std::move(exchange)), as_csv_(as_csv) {}

  /// Takes the first chunk, which has the columns.
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
      throw std::runtime_error("a reader process of the server sent no valid answer");
    }
    for (protocol::ChunkRows rows(chunk); rows.next(); ++rows_) {
      ordered_json values = ordered_json::array();
      for (std::size_t i = 0; i < rows.columns(); ++i) {
        values.push_back(json_of(rows.cell(i)));
      }
      text_ += as_csv_ ? csv_line(values) : (rows_ == 0 ? "" : ",\n") + json_text(values);
    }
    has_ended_ = chunk.ends();
    if (has_ended_) {
      text_ += as_csv_ ? "" : "]}\n";
      return;
    }
    ClientRequest more;
    more.mutable_more_rows()->set_request_id(exchange_->number());
    more.mutable_more_rows()->set_taken(++chunks_);
    exchange_->send(more);
  }

  std::shared_ptr<ServiceExchange> exchange_;
  bool as_csv_;
  std::string text_;  // not sent yet
  std::uint64_t chunks_ = 0;
  std::uint64_t rows_ = 0;
  bool has_ended_ = false;
};

}  // namespace

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

PendingAnswer named_study_flow(std::shared_ptr<ServiceExchange> exchange, std::uint64_t study,
                               std::function<ClientRequest(const std::string&)> request,
                               OnReply on_reply) {
  ClientRequest first;
  first.mutable_status()->set_study_id(study);
  exchange->send(first);
  return
      [exchange = std::move(exchange), request = std::move(request), on_reply = std::move(on_reply),
       named = PendingAnswer()]() mutable -> std::optional<HttpAnswer> {
        if (!named) {
          const auto reply = exchange->reply();
          if (!reply) {
            return std::nullopt;
          }
          if (reply->has_error()) {
            HttpAnswer answer = failure(reply->error());
            return answer.status == MHD_HTTP_NOT_FOUND
                       ? error_answer(MHD_HTTP_NOT_FOUND, "there is no such study")
                       : answer;
          }
          named = request_flow(exchange, request(reply->status().studies(0).name()), on_reply);
        }
        return named();
      };
}

PendingAnswer list_studies(ServiceClient& service, const Fields& fields) {
  ClientRequest request;
  request.mutable_status()->set_after_study_id(FieldReader(fields).whole("after").value_or(0));
  request.mutable_status()->set_limit(lines_of(fields));
  return request_flow(
      std::make_shared<ServiceExchange>(service), request,
      [](const ClientReply& reply) -> NextStep {
        ordered_json studies = ordered_json::array();
        for (const auto& study : reply.status().studies()) {
          studies.push_back(study_json(study));
        }
        return json_answer({{"studies", studies}, {"next_after", reply.status().next_after()}});
      });
}

PendingAnswer list_workers(ServiceClient& service, const Fields& fields) {
  ClientRequest request;
  request.mutable_workers()->set_after_worker_id(FieldReader(fields).whole("after").value_or(0));
  request.mutable_workers()->set_limit(lines_of(fields));
  return request_flow(
      std::make_shared<ServiceExchange>(service), request,
      [](const ClientReply& reply) -> NextStep {
        ordered_json workers = ordered_json::array();
        for (const auto& worker : reply.workers().workers()) {
          workers.push_back(worker_json(worker));
        }
        return json_answer({{"workers", workers}, {"next_after", reply.workers().next_after()}});
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
  query.set_limit(std::min(reader.whole("limit").value_or(kUsualRows), kMostRows));
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
                                            {"settled", submitted.settled()},
                                            {"created", submitted.created()},
                                            {"appended", submitted.appended()},
                                            {"taken", submitted.taken().points()}});
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

}  // namespace oblique::server
