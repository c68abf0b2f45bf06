#include "client/output/trace_table.h"

#include <string_view>
#include <variant>

#include "client/output/printer.h"
#include "worker/solver/model/number.h"

namespace oblique::client {

void print_trace_header(std::ostream& out, const solver::TraceShape& shape) {
  std::string_view separator;
  for (const auto& heading : solver::trace_headings(shape)) {
    out << separator << heading;
    separator = ",";
  }
  out << '\n';
}

void print_trace_row(std::ostream& out, const solver::TraceRow& row) {
  std::string_view separator;
  const auto put = [&](double value) {
    out << separator << solver::exact_number(value);
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
      out << separator << csv_field(row.*std::get<std::string solver::TraceRow::*>(column.value));
    }
  }
  out << '\n';
}

}  // namespace oblique::client
