// CSV, JSON and JSON lines.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <variant>

#include <nlohmann/json.hpp>

#include "client/io/row_output.h"
#include "proto/text.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::client {
namespace {

using nlohmann::ordered_json;
using protocol::Cell;
using protocol::CellKind;

class CsvPrinter : public RowPrinter {
 public:
  void print(const protocol::QueryReply& chunk, std::string& out) override {
    if (!std::exchange(has_header_, true)) {
      for (int i = 0; i < chunk.columns_size(); ++i) {
        out += i > 0 ? "," : "";
        append_csv_field(out, chunk.columns(i));
      }
      out += '\n';
    }
    protocol::ChunkRows rows(chunk);
    while (rows.next()) {
      for (std::size_t i = 0; i < rows.columns(); ++i) {
        out.append(i > 0 ? 1 : 0, ',');
        append_cell(out, rows.cell(i));
      }
      out += '\n';
    }
  }
  void end(std::string&) override {}

 private:
  static void append_cell(std::string& out, const Cell& cell) {
    if (cell.kind == CellKind::kInteger) {
      append_number(out, cell.integer);
    } else if (cell.kind == CellKind::kReal) {
      append_number(out, cell.real);
    } else if (cell.kind == CellKind::kText) {
      append_csv_field(out, cell.text);
    }
  }

  bool has_header_ = false;
};

/// A list that a column stores as JSON text.
struct PackedList {
  std::span<const std::string_view> members;  // of an element; empty: they have no names
};

/// What the column of that name stores; nothing where that is no list.
std::optional<PackedList> packed_list(std::string_view column) {
  const auto* list = solver::find_result_list(column);
  bool is_part = false;
  if (const auto* field = solver::find_result_column(column)) {
    if (const auto* part = std::get_if<solver::ListPart>(&field->value)) {
      list = part->list;
      is_part = !part->member.empty();
    }
  }
  if (list != nullptr) {
    return list->has_names && !is_part ? PackedList{list->members} : PackedList{};
  }
  return column == "lengths_m" ? std::optional(PackedList{}) : std::nullopt;
}

/// The elements of a list; those with names become objects, as in `solve --json`. Nothing where the
/// text is no list of plain values or of lists of them.
std::optional<ordered_json> unpacked(const PackedList& packed, std::string_view text) {
  auto list = ordered_json::parse(text.begin(), text.end(), nullptr, false);
  if (!list.is_array()) {
    return std::nullopt;
  }
  const auto is_plain = [](const ordered_json& value) { return value.is_primitive(); };
  for (auto& element : list) {
    if (!is_plain(element) &&
        !(element.is_array() && std::all_of(element.begin(), element.end(), is_plain))) {
      return std::nullopt;
    }
    if (packed.members.empty()) {
      continue;
    }
    if (!element.is_array() || element.size() != packed.members.size()) {
      return std::nullopt;
    }
    ordered_json object = ordered_json::object();
    for (std::size_t i = 0; i < packed.members.size(); ++i) {
      object[std::string(packed.members[i])] = element[i];
    }
    element = std::move(object);
  }
  return std::optional<ordered_json>(std::in_place, std::move(list));
}

/// As \u.... wherever a terminal would act on a character; bytes that are not UTF-8 become U+FFFD.
void append_json(std::string& out, const ordered_json& value, bool only_ascii) {
  out += value.dump(-1, ' ', only_ascii, ordered_json::error_handler_t::replace);
}

void append_json_text(std::string& out, std::string_view text) {
  const auto is_plain = [](char c) { return c >= ' ' && c < '\x7f' && c != '"' && c != '\\'; };
  if (std::all_of(text.begin(), text.end(), is_plain)) {
    out.append("\"").append(text).append("\"");
  } else {
    append_json(out, text, !protocol::is_visible(text));
  }
}

/// A finite number so that readers of JSON take it for a real one: 7.0. Else `null`.
void append_json_real(std::string& out, double value) {
  if (!std::isfinite(value)) {
    out += "null";
    return;
  }
  const std::size_t before = out.size();
  append_number(out, value);
  if (out.find_first_of(".e", before) == std::string::npos) {
    out += ".0";
  }
}

/// The names of columns; of equal ones the second becomes name_2, and so on.
std::vector<std::string> distinct_names(const protocol::QueryReply& chunk) {
  std::vector<std::string> names;
  const auto contains = [](const auto& list, const std::string& name) {
    return std::find(list.begin(), list.end(), name) != list.end();
  };
  for (const std::string& column : chunk.columns()) {
    std::string name = column;
    for (int i = 2; contains(names, name) || (i > 2 && contains(chunk.columns(), name)); ++i) {
      name = column + "_" + std::to_string(i);
    }
    names.push_back(std::move(name));
  }
  return names;
}

class JsonPrinter : public RowPrinter {
 public:
  explicit JsonPrinter(bool has_lines) : has_lines_(has_lines) {}

  void print(const protocol::QueryReply& chunk, std::string& out) override {
    if (!std::exchange(has_begun_, true)) {
      begin(chunk, out);
    }
    protocol::ChunkRows rows(chunk);
    while (rows.next()) {
      if (!has_lines_) {
        out += std::exchange(has_rows_, true) ? ",\n" : "\n";
      }
      out += '{';
      for (std::size_t i = 0; i < rows.columns(); ++i) {
        out += keys_[i].text;
        append_value(out, keys_[i], rows.cell(i));
      }
      out += has_lines_ ? "}\n" : "}";
    }
  }
  void end(std::string& out) override {
    if (!has_lines_) {
      out += has_begun_ ? "" : "[";
      out += has_rows_ ? "\n]\n" : "]\n";
    }
  }

 private:
  struct Key {
    std::string text;  // before each value: ,"name":
    std::optional<PackedList> packed;
  };

  void begin(const protocol::QueryReply& chunk, std::string& out) {
    const std::vector<std::string> names = distinct_names(chunk);
    for (std::size_t i = 0; i < names.size(); ++i) {
      Key key{i > 0 ? "," : "", packed_list(chunk.columns(static_cast<int>(i)))};
      append_json_text(key.text, names[i]);
      key.text += ':';
      keys_.push_back(std::move(key));
    }
    out += has_lines_ ? "" : "[";
  }

  static void append_value(std::string& out, const Key& key, const Cell& cell) {
    if (cell.kind == CellKind::kInteger) {
      append_number(out, cell.integer);
    } else if (cell.kind == CellKind::kReal) {
      append_json_real(out, cell.real);
    } else if (cell.kind == CellKind::kNull) {
      out += "null";
    } else if (const auto list = key.packed ? unpacked(*key.packed, cell.text) : std::nullopt) {
      append_json(out, *list, true);
    } else {
      append_json_text(out, cell.text);
    }
  }

  bool has_lines_;
  std::vector<Key> keys_;
  bool has_begun_ = false;
  bool has_rows_ = false;
};

}  // namespace

void append_number(std::string& out, double value) {
  std::array<char, solver::kLongestExactNumber> text;
  out.append(text.data(), solver::write_exact_number(value, text.data()));
}

void append_number(std::string& out, std::int64_t value) {
  std::array<char, 24> text;
  out.append(text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr);
}

void append_csv_field(std::string& out, std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos && !text.empty()) {
    out += text;
    return;
  }
  out += '"';
  for (const char letter : text) {
    out.append(letter == '"' ? 2 : 1, letter);
  }
  out += '"';
}

std::unique_ptr<RowPrinter> make_printer(const OutputSettings& settings) {
  switch (settings.format) {
    case Format::kCsv:
      return std::make_unique<CsvPrinter>();
    case Format::kJson:
      return std::make_unique<JsonPrinter>(false);
    case Format::kJsonLines:
      return std::make_unique<JsonPrinter>(true);
    case Format::kTable:
      break;
  }
  return make_table_printer(settings);
}

}  // namespace oblique::client
