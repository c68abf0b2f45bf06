#include "client/python/query_columns.h"

#include <limits>

#include "proto/wire/chunk.h"

namespace oblique::python {
namespace {

using protocol::CellKind;

void add_cell(AnswerColumn& column, const protocol::Cell& cell) {
  const bool is_text = cell.kind == CellKind::kText;
  if (is_text && !column.has_text) {
    column.has_text = true;
    column.texts.resize(column.kinds.size());
  }
  column.has_real = column.has_real || cell.kind == CellKind::kReal;
  column.has_null = column.has_null || cell.kind == CellKind::kNull;
  column.kinds.push_back(static_cast<char>(cell.kind));
  column.integers.push_back(cell.kind == CellKind::kInteger ? cell.integer : 0);
  column.reals.push_back(cell.kind == CellKind::kReal ? cell.real
                         : cell.kind == CellKind::kInteger
                             ? static_cast<double>(cell.integer)
                             : std::numeric_limits<double>::quiet_NaN());
  if (column.has_text) {
    column.texts.emplace_back(is_text ? cell.text : std::string_view());
  }
}

}  // namespace

void QueryColumns::add(const protocol::QueryReply& chunk) {
  if (columns_.empty()) {
    for (int i = 0; i < chunk.columns_size(); ++i) {
      AnswerColumn& column = columns_.emplace_back();
      column.name = chunk.columns(i);
      column.unit = i < chunk.units_size() ? chunk.units(i) : "";
    }
  }
  protocol::ChunkRows rows(chunk);
  while (rows.next()) {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      add_cell(columns_[i], rows.cell(i));
    }
  }
}

}  // namespace oblique::python
