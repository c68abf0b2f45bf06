#include "client/trace/trace_archive.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <variant>

#include "proto/wire/cell.h"

namespace oblique::client {
namespace {

protocol::Cell cell_of(double number) {
  return {.kind = protocol::CellKind::kReal, .real = number};
}

}  // namespace

TraceArchive::TraceArchive(const solver::TraceShape& shape, const std::string& folder) {
  for (std::string& heading : solver::trace_headings({shape.links, 0})) {
    columns_.push_back({std::move(heading), std::make_unique<NpyColumn>(folder)});
  }
  if (shape.nodes > 0) {
    const std::vector<std::uint64_t> row_shape{shape.nodes, 2};
    columns_.push_back({"nodes_m", std::make_unique<NpyColumn>(folder, row_shape)});
  }
}

void TraceArchive::add(const solver::TraceRow& row) {
  auto next = columns_.begin();
  for (const auto& column : solver::trace_columns()) {
    if (const auto* number = std::get_if<double solver::TraceRow::*>(&column.value)) {
      (next++)->column->add(cell_of(row.*(*number)));
    } else if (const auto* text = std::get_if<std::string solver::TraceRow::*>(&column.value)) {
      (next++)->column->add({.kind = protocol::CellKind::kText, .text = row.*(*text)});
    } else {
      const auto& vectors = std::get<solver::TraceVectors>(column.value);
      for (const double value : row.*(vectors.values)) {
        next->column->add(cell_of(value));
        next += vectors.of_links ? 1 : 0;
      }
    }
  }
}

}  // namespace oblique::client
