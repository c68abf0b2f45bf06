#include "client/formats/json_printer.h"

#include <utility>

#include "client/formats/cell_text.h"
#include "proto/wire/chunk.h"

namespace oblique::client {

void JsonPrinter::begin(const protocol::QueryReply& chunk) {
  const std::vector<std::string> names = distinct_names(chunk);
  for (std::size_t i = 0; i < names.size(); ++i) {
    Key key{i > 0 ? "," : "", packed_list(chunk.columns(static_cast<int>(i)))};
    append_json_text(key.text, names[i]);
    key.text += ':';
    keys_.push_back(std::move(key));
  }
  if (shape_ == Shape::kArray) {
    sink_.append("[");
  }
  has_begun_ = true;
}

void JsonPrinter::append_value(std::string& out, const Key& key, const protocol::Cell& cell) {
  using protocol::CellKind;
  switch (cell.kind) {
    case CellKind::kInteger:
      append_number(out, cell.integer);
      break;
    case CellKind::kReal:
      append_json_real(out, cell.real);
      break;
    case CellKind::kText:
      if (const auto list = key.packed ? unpacked(*key.packed, cell.text) : std::nullopt) {
        // Nothing that a terminal would act on is left.
        out += list->dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
      } else {
        append_json_text(out, cell.text);
      }
      break;
    case CellKind::kNull:
      out += "null";
      break;
  }
}

void JsonPrinter::print(const protocol::QueryReply& chunk) {
  if (!has_begun_) {
    begin(chunk);
  }
  std::string& out = sink_.held();
  protocol::ChunkRows rows(chunk);
  while (rows.next()) {
    if (shape_ == Shape::kArray) {
      out += std::exchange(has_rows_, true) ? ",\n" : "\n";
    }
    out += '{';
    for (std::size_t i = 0; i < rows.columns(); ++i) {
      out += keys_[i].text;
      append_value(out, keys_[i], rows.cell(i));
    }
    out += shape_ == Shape::kLines ? "}\n" : "}";
    sink_.flush_if_long();
  }
}

void JsonPrinter::end() {
  if (shape_ == Shape::kArray) {
    sink_.append(has_begun_ ? "" : "[");
    sink_.append(has_rows_ ? "\n]\n" : "]\n");
  }
}

}  // namespace oblique::client
