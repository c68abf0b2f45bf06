#include "client/output/printer.h"

#include <algorithm>
#include <cstddef>

#include "client/io/row_output.h"
#include "client/io/sink.h"
#include "proto/wire/chunk.h"

namespace oblique::client {

std::string csv_field(std::string_view text) {
  std::string field;
  append_csv_field(field, text);
  return field;
}

void print(std::ostream& out, const protocol::Table& rows, Format format) {
  out << text_of({protocol::chunk_of(rows)}, {.format = format});
}

void print_out(const protocol::Table& rows, Format format) {
  RowOutput out({.format = format, .may_page = false, .may_leave_out = false});
  out.print(protocol::chunk_of(rows));
  out.finish();
}

void align_right(protocol::Table& rows, const std::vector<std::string>& columns) {
  for (std::size_t column = 0; column < rows.columns.size(); ++column) {
    std::string& heading = rows.columns[column];
    if (std::find(columns.begin(), columns.end(), heading) == columns.end()) {
      continue;
    }
    std::size_t width = heading.size();
    for (const auto& row : rows.rows) {
      width = std::max(width, std::get<std::string>(row[column]).size());
    }
    for (auto& row : rows.rows) {
      auto& text = std::get<std::string>(row[column]);
      text.insert(0, width - text.size(), ' ');
    }
    heading.insert(0, width - heading.size(), ' ');
  }
}

void add_value(protocol::Row& row, const std::string& text) {
  row.emplace_back(text);
}
void add_value(protocol::Row& row, double value) {
  row.emplace_back(value);
}
void add_value(protocol::Row& row, std::int64_t value) {
  row.emplace_back(value);
}

}  // namespace oblique::client
