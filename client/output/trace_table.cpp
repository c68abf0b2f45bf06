#include "client/output/trace_table.h"

#include <string_view>
#include <variant>

#include "client/io/row_output.h"

namespace oblique::client {

void append_trace_header(std::string& text, const solver::TraceShape& shape) {
  std::string_view separator;
  for (const auto& heading : solver::trace_headings(shape)) {
    text.append(separator).append(heading);
    separator = ",";
  }
  text += '\n';
}

void append_trace_row(std::string& text, const solver::TraceRow& row) {
  std::string_view separator;
  const auto put = [&](double value) {
    text.append(separator);
    append_number(text, value);
    separator = ",";
  };
  for (const auto& column : solver::trace_columns()) {
    if (const auto* number = std::get_if<double solver::TraceRow::*>(&column.value)) {
      put(row.*(*number));
    } else if (const auto* vectors = std::get_if<solver::TraceVectors>(&column.value)) {
      for (const double value : row.*(vectors->values)) {
        put(value);
      }
    } else {
      text.append(separator);
      append_csv_field(text, row.*std::get<std::string solver::TraceRow::*>(column.value));
    }
  }
  text += '\n';
}

}  // namespace oblique::client
