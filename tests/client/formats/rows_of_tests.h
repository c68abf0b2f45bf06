#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "client/formats/row_printer.h"
#include "proto/wire/chunk.h"

namespace oblique::test {

using TestCell = std::variant<std::nullptr_t, std::int64_t, double, std::string>;
using TestRows = std::vector<std::vector<TestCell>>;

inline protocol::QueryReply chunk_of(const std::vector<std::string>& columns,
                                     const TestRows& rows) {
  protocol::ChunkWriter writer(columns);
  for (const auto& row : rows) {
    for (const TestCell& cell : row) {
      if (const auto* integer = std::get_if<std::int64_t>(&cell)) {
        writer.integer(*integer);
      } else if (const auto* real = std::get_if<double>(&cell)) {
        writer.real(*real);
      } else if (const auto* text = std::get_if<std::string>(&cell)) {
        writer.text(*text);
      } else {
        writer.null();
      }
    }
    writer.end_row();
  }
  return writer.take();
}

/// The chunks, one after another, as text.
inline std::string printed(client::Format format, const std::vector<protocol::QueryReply>& chunks,
                           client::PrinterSettings settings = {}) {
  client::TextSink sink;
  const auto printer = client::made_printer(format, sink, std::move(settings));
  for (const auto& chunk : chunks) {
    printer->print(chunk);
  }
  printer->end();
  sink.finish();
  return sink.text();
}

}  // namespace oblique::test
