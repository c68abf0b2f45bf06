#include "client/output/printer.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <iostream>
#include <iterator>
#include <sstream>
#include <vector>

#include <nlohmann/json.hpp>

#include "client/output/packed_columns.h"
#include "proto/suggestion.h"
#include "proto/text.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

using protocol::QueryReply;
using protocol::Value;

constexpr std::array<std::string_view, 4> kFormatNames{"table", "csv", "json", "markdown"};

// Columns that a person sees: characters, not bytes of UTF-8.
std::size_t width_of(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char byte) {
    return (static_cast<unsigned char>(byte) & 0xc0) != 0x80;
  }));
}

std::string table_cell(const Value& value) {
  switch (value.kind_case()) {
    case Value::kInteger:
      return std::to_string(value.integer());
    case Value::kReal:
      return solver::readable_number(value.real());
    case Value::kText: {
      // A line break inside a cell would break the table.
      auto text = value.text();
      std::replace_if(
          text.begin(), text.end(), [](char c) { return c == '\n' || c == '\t'; }, ' ');
      return protocol::visible(text);
    }
    default:
      return "-";
  }
}

void print_line(std::ostream& out, const std::vector<std::string>& cells,
                const std::vector<std::size_t>& widths, const std::vector<bool>& right) {
  std::string line;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::string padding(widths[i] - width_of(cells[i]), ' ');
    line += i > 0 ? "  " : "";
    line += right[i] ? padding + cells[i] : cells[i] + padding;
  }
  line.erase(line.find_last_not_of(' ') + 1);
  out << line << '\n';
}

void print_table(std::ostream& out, const QueryReply& rows) {
  const auto columns = static_cast<std::size_t>(rows.columns_size());
  std::vector<std::string> header;
  std::transform(rows.columns().begin(), rows.columns().end(), std::back_inserter(header),
                 protocol::visible);
  std::vector<std::size_t> widths;
  std::transform(header.begin(), header.end(), std::back_inserter(widths), width_of);
  std::vector<bool> right(columns, false);
  std::vector<std::vector<std::string>> cells;
  for (const auto& row : rows.rows()) {
    auto& line = cells.emplace_back(columns);
    for (std::size_t i = 0; i < columns; ++i) {
      const auto& value = row.values(static_cast<int>(i));
      line[i] = table_cell(value);
      widths[i] = std::max(widths[i], width_of(line[i]));
      if (value.has_integer() || value.has_real()) {
        right[i] = true;
      }
    }
  }
  print_line(out, header, widths, right);
  std::vector<std::string> rule;
  std::transform(widths.begin(), widths.end(), std::back_inserter(rule),
                 [](std::size_t width) { return std::string(width, '-'); });
  print_line(out, rule, widths, right);
  for (const auto& line : cells) {
    print_line(out, line, widths, right);
  }
}

std::string markdown_cell(const std::string& text) {
  std::string cell;
  for (const char letter : text) {
    cell += letter == '|' ? "\\|" : std::string(1, letter);
  }
  return cell;
}

void print_markdown(std::ostream& out, const QueryReply& rows) {
  std::string header = "|";
  std::string rule = "|";
  for (int i = 0; i < rows.columns_size(); ++i) {
    const bool is_number = rows.rows_size() > 0 && (rows.rows(0).values(i).has_integer() ||
                                                    rows.rows(0).values(i).has_real());
    header += ' ' + markdown_cell(protocol::visible(rows.columns(i))) + " |";
    rule += is_number ? "---:|" : "---|";
  }
  out << header << '\n' << rule << '\n';
  for (const auto& row : rows.rows()) {
    out << '|';
    for (const auto& value : row.values()) {
      out << ' ' << markdown_cell(table_cell(value)) << " |";
    }
    out << '\n';
  }
}

std::string csv_value(const Value& value) {
  switch (value.kind_case()) {
    case Value::kInteger:
      return std::to_string(value.integer());
    case Value::kReal:
      return solver::exact_number(value.real());
    case Value::kText:
      return csv_field(value.text());
    default:
      return {};
  }
}

void print_csv(std::ostream& out, const QueryReply& rows) {
  std::string line;
  for (const auto& column : rows.columns()) {
    line += line.empty() ? "" : ",";
    line += csv_field(column);
  }
  out << line << '\n';
  for (const auto& row : rows.rows()) {
    line.clear();
    for (int i = 0; i < row.values_size(); ++i) {
      line += i == 0 ? "" : ",";
      line += csv_value(row.values(i));
    }
    out << line << '\n';
  }
}

nlohmann::ordered_json json_value(const std::string& column, const Value& value) {
  switch (value.kind_case()) {
    case Value::kInteger:
      return value.integer();
    case Value::kReal:
      return std::isfinite(value.real()) ? nlohmann::ordered_json(value.real())
                                         : nlohmann::ordered_json();
    case Value::kText:
      if (auto list = unpacked(column, value.text())) {
        return *std::move(list);
      }
      return value.text();
    default:
      return {};
  }
}

// A key stands for one value only: of equal names the second becomes name_2, and so on.
std::vector<std::string> distinct_names(const QueryReply& rows) {
  std::vector<std::string> names;
  const auto is_taken = [&names, &rows](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end() ||
           std::find(rows.columns().begin(), rows.columns().end(), name) != rows.columns().end();
  };
  for (const std::string& column : rows.columns()) {
    std::string name = column;
    const bool is_first = std::find(names.begin(), names.end(), name) == names.end();
    for (int i = 2; !is_first && is_taken(name); ++i) {
      name = column + "_" + std::to_string(i);
    }
    names.push_back(std::move(name));
  }
  return names;
}

// JSON with the characters written as \u.... that a terminal would act on. They stand in texts
// alone, and there mean the same.
std::string harmless(std::string_view json) {
  std::string shown;
  while (!json.empty()) {
    const auto next = protocol::first_character(json);
    if (protocol::is_control(next.code)) {
      std::array<char, 8> escape{};
      std::snprintf(escape.data(), escape.size(), "\\u%04x", static_cast<unsigned>(next.code));
      shown += escape.data();
    } else {
      shown += json.substr(0, next.bytes);
    }
    json.remove_prefix(next.bytes);
  }
  return shown;
}

void print_json(std::ostream& out, const QueryReply& rows) {
  const auto names = distinct_names(rows);
  out << '[';
  const char* separator = "\n";
  for (const auto& row : rows.rows()) {
    nlohmann::ordered_json object = nlohmann::ordered_json::object();
    for (int i = 0; i < row.values_size(); ++i) {
      object[names[static_cast<std::size_t>(i)]] = json_value(rows.columns(i), row.values(i));
    }
    out << separator
        << harmless(object.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
    separator = ",\n";
  }
  out << (rows.rows().empty() ? "]\n" : "\n]\n");
}

}  // namespace

Format format_named(std::string_view name) {
  const auto found = std::find(kFormatNames.begin(), kFormatNames.end(), name);
  if (found == kFormatNames.end()) {
    throw solver::InputError("format = \"" + std::string(name) +
                             "\" is not allowed: it must be one of " +
                             protocol::joined(kFormatNames));
  }
  return static_cast<Format>(found - kFormatNames.begin());
}

std::string csv_field(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos && !text.empty()) {
    return std::string(text);
  }
  // An empty text is quoted too, for an empty field is NULL.
  std::string field = "\"";
  for (const char letter : text) {
    field.append(letter == '"' ? 2 : 1, letter);
  }
  field += '"';
  return field;
}

void print(std::ostream& out, const QueryReply& rows, Format format) {
  switch (format) {
    case Format::kTable:
      print_table(out, rows);
      break;
    case Format::kCsv:
      print_csv(out, rows);
      break;
    case Format::kJson:
      print_json(out, rows);
      break;
    case Format::kMarkdown:
      print_markdown(out, rows);
      break;
  }
}

void print_out(const QueryReply& rows, Format format) {
  if (format != Format::kCsv || isatty(STDOUT_FILENO) != 1) {
    print(std::cout, rows, format);
    return;
  }
  std::ostringstream text;
  print(text, rows, format);
  std::cout << protocol::visible_lines(text.str());
}

void add_value(protocol::Row& row, const std::string& text) {
  row.add_values()->set_text(text);
}
void add_value(protocol::Row& row, double value) {
  row.add_values()->set_real(value);
}
void add_value(protocol::Row& row, std::int64_t value) {
  row.add_values()->set_integer(value);
}

}  // namespace oblique::client
