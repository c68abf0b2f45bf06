#include <algorithm>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "proto/wire/chunk.h"
#include "server/web/answers/fields.h"
#include "server/web/http/json_answer.h"
#include "server/web/page/talks.h"

namespace oblique::server {
namespace {

using nlohmann::ordered_json;

constexpr std::uint64_t kUsualRows = 200;
constexpr std::uint64_t kMostRows = 100'000;
/// An answer that gets longer is cut off there, and says so.
constexpr std::size_t kMostAnswerBytes = std::size_t{16} << 20U;

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

/// Rows as they come, chunk by chunk.
struct ComingRows {
  protocol::StudyQuery question;
  bool as_csv = false;
  std::uint64_t chunks = 0;
  std::uint64_t rows = 0;
  bool is_cut_off = false;
  ordered_json columns = ordered_json::array();
  ordered_json units = ordered_json::array();
  std::string text = {};  ///< of the rows

  void take(const protocol::QueryReply& chunk);
  HttpAnswer answer() const;

 private:
  std::string line(const ordered_json& values) const;
};

std::string ComingRows::line(const ordered_json& values) const {
  if (!as_csv) {
    return values.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
  }
  std::string fields;
  for (const ordered_json& value : values) {
    fields += (&value == &values.front() ? "" : ",") + csv_field(value);
  }
  return fields + "\r\n";
}

void ComingRows::take(const protocol::QueryReply& chunk) {
  if (!protocol::is_sound(chunk)) {
    throw std::runtime_error("a reader of the server gave what is no answer");
  }
  if (chunks++ == 0) {
    columns = std::vector<std::string>(chunk.columns().begin(), chunk.columns().end());
    units = std::vector<std::string>(chunk.units().begin(), chunk.units().end());
  }
  protocol::ChunkRows lines(chunk);
  while (!is_cut_off && lines.next()) {
    ordered_json values = ordered_json::array();
    for (std::size_t i = 0; i < lines.columns(); ++i) {
      values.push_back(json_of(lines.cell(i)));
    }
    text += (as_csv || rows == 0 ? "" : ",\n") + line(values);
    ++rows;
    is_cut_off = text.size() > kMostAnswerBytes;
  }
}

HttpAnswer ComingRows::answer() const {
  constexpr unsigned kOk = 200;
  if (as_csv) {
    return {kOk,
            "text/csv; charset=utf-8",
            line(columns) + text,
            {{"Content-Disposition", "attachment; filename=\"rows.csv\""},
             {"X-Oblique-Truncated", is_cut_off ? "1" : "0"}}};
  }
  const ordered_json head{{"columns", columns}, {"units", units}, {"truncated", is_cut_off}};
  std::string body = head.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
  body.back() = ',';  // instead of the brace
  return {kOk, "application/json", body + "\"rows\":[" + text + "]}\n"};
}

}  // namespace

Talk rows_talk(std::uint64_t study, const HttpQuestion& question) {
  const FieldReader fields(question.fields);
  const std::string format = fields.text("format").value_or("json");
  if (format != "json" && format != "csv") {
    throw std::invalid_argument("format must be json or csv");
  }
  auto coming = std::make_shared<ComingRows>();
  coming->as_csv = format == "csv";
  protocol::StudyQuery& asked = coming->question;
  asked.set_where(fields.text("where").value_or(""));
  asked.set_group(fields.text("group").value_or(""));
  asked.set_order(fields.text("order").value_or(""));
  if (const auto select = fields.text("select")) {
    asked.add_select(*select);
  }
  asked.set_limit(std::min(fields.whole("limit").value_or(kUsualRows), kMostRows));
  return talk_by_name(
      study,
      [coming](const std::string& name) {
        protocol::ClientRequest request;
        *request.mutable_query()->mutable_question() = coming->question;
        request.mutable_query()->mutable_question()->set_study(name);
        return request;
      },
      [coming, number = question.number](const protocol::ClientReply& reply) -> Talk::Next {
        coming->take(reply.query());
        if (reply.query().ends() || coming->is_cut_off) {
          return coming->answer();
        }
        protocol::ClientRequest more;
        more.mutable_more_rows()->set_request_id(number);
        more.mutable_more_rows()->set_taken(coming->chunks);
        return more;
      },
      too_slow());
}

}  // namespace oblique::server
