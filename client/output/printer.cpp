#include "client/output/printer.h"

#include <algorithm>
#include <cstddef>

#include "client/formats/cell_text.h"
#include "client/formats/row_output.h"
#include "client/formats/sink.h"
#include "proto/wire/chunk_writer.h"

namespace oblique::client {

std::string csv_field(std::string_view text) {
  std::string field;
  append_csv_field(field, text);
  return field;
}

void print(std::ostream& out, const protocol::QueryReply& rows, Format format) {
  TextSink text;
  const auto printer = made_printer(format, text);
  printer->print(protocol::as_chunk(rows));
  printer->end();
  text.finish();
  out << text.text();
}

void print_out(const protocol::QueryReply& rows, Format format) {
  RowOutput out({.format = format, .may_page = false, .may_leave_out = false});
  out.print(protocol::as_chunk(rows));
  out.finish();
}

void align_right(protocol::QueryReply& rows, const std::vector<std::string>& columns) {
  for (int column = 0; column < rows.columns_size(); ++column) {
    if (std::find(columns.begin(), columns.end(), rows.columns(column)) == columns.end()) {
      continue;
    }
    std::size_t width = rows.columns(column).size();
    for (const auto& row : rows.rows()) {
      width = std::max(width, row.values(column).text().size());
    }
    for (auto& row : *rows.mutable_rows()) {
      std::string& text = *row.mutable_values(column)->mutable_text();
      text.insert(0, width - text.size(), ' ');
    }
    std::string& heading = *rows.mutable_columns(column);
    heading.insert(0, width - heading.size(), ' ');
  }
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
