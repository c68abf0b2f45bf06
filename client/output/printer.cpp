#include "client/output/printer.h"

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
