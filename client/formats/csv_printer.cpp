#include "client/formats/csv_printer.h"

#include "client/formats/cell_text.h"
#include "proto/wire/chunk.h"

namespace oblique::client {
namespace {

void append_csv_cell(std::string& out, const protocol::Cell& cell) {
  using protocol::CellKind;
  switch (cell.kind) {
    case CellKind::kInteger:
      append_number(out, cell.integer);
      break;
    case CellKind::kReal:
      append_number(out, cell.real);
      break;
    case CellKind::kText:
      append_csv_field(out, cell.text);
      break;
    case CellKind::kNull:
      break;
  }
}

}  // namespace

void CsvPrinter::print(const protocol::QueryReply& chunk) {
  std::string& out = sink_.held();
  if (!has_header_) {
    for (int i = 0; i < chunk.columns_size(); ++i) {
      out += i > 0 ? "," : "";
      append_csv_field(out, chunk.columns(i));
    }
    out += '\n';
    has_header_ = true;
  }
  protocol::ChunkRows rows(chunk);
  while (rows.next()) {
    for (std::size_t i = 0; i < rows.columns(); ++i) {
      if (i > 0) {
        out += ',';
      }
      append_csv_cell(out, rows.cell(i));
    }
    out += '\n';
    sink_.flush_if_long();
  }
}

}  // namespace oblique::client
