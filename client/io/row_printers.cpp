// Formats rows as CSV, JSON, JSON lines and tables.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/io/console.h"
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
        protocol::append_csv_field(out, chunk.columns(i));
      }
      out += '\n';
    }
    protocol::ChunkRows rows(chunk);
    while (rows.next()) {
      const std::size_t before = out.size();
      for (std::size_t i = 0; i < rows.columns(); ++i) {
        out.append(i > 0 ? 1 : 0, ',');
        append_cell(out, rows.cell(i));
      }
      out += out.size() == before ? "\"\"\n" : "\n";  // readers skip empty lines
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
      protocol::append_csv_field(out, cell.text);
    }
  }

  bool has_header_ = false;
};

/// Describes a list that a column stores as JSON text.
struct PackedList {
  std::span<const std::string_view> members;  // names of the members of each element; empty: none
};

/// Returns the list that a column stores, or nothing if it stores no list.
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

/// Parses a list. Elements with named members become objects, as in `solve --json`. Returns nothing
/// if the text is not a list of plain values or of lists of plain values.
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

/// Appends a value as JSON. Escapes characters that would control a terminal as \u....; replaces
/// invalid UTF-8 by U+FFFD.
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

/// Appends a finite number with a point or exponent, such as 7.0, so that JSON readers parse it as
/// a real number; appends `null` for other numbers.
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

/// Returns the column names, each once: of equal names the second becomes name_2, and so on.
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
    std::string text;  // text before each value, such as ,"name":
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

constexpr std::size_t kGap = 2;     // between columns
constexpr const char* kMore = "…";  // ends the heading if columns are omitted
/// Texts are never shortened below this length.
constexpr std::size_t kShortestText = 12;
/// Sentences are never wrapped below this width.
constexpr std::size_t kNarrowestSentence = 16;

/// Formats a value for a table: on one line, numbers with six digits, NULL as a dash.
std::string table_cell(const Cell& cell, double per_unit) {
  switch (cell.kind) {
    case CellKind::kInteger:
      return std::to_string(cell.integer);
    case CellKind::kReal:
      return solver::readable_number(cell.real * per_unit);
    case CellKind::kText: {
      std::string text(cell.text);
      std::replace_if(
          text.begin(), text.end(), [](char c) { return c == '\n' || c == '\t'; }, ' ');
      return protocol::visible(text);
    }
    case CellKind::kNull:
      break;
  }
  return "-";
}

/// Number of characters before the decimal point; all characters if there is no point.
std::size_t before_point(std::string_view number) {
  return std::min(number.find('.'), number.size());
}

/// Returns at most the first `width` characters; the last is an ellipsis if the text is longer.
std::string shortened_to(const std::string& text, std::size_t width) {
  if (width_of(text) <= width) {
    return text;
  }
  std::size_t bytes = 0;
  for (std::size_t i = 0; i + 1 < width; ++i) {
    bytes += std::max<std::size_t>(
        protocol::first_character(std::string_view(text).substr(bytes)).bytes, 1);
  }
  return text.substr(0, bytes) + "…";
}

/// Prints a table. The first rows determine the column widths; a wider value in a later row shifts
/// the rest of its line. If lines are too long, texts are shortened first; then columns are omitted
/// from the right, and a line below the table names them. Another line explains the letters of
/// modes.
class TablePrinter : public RowPrinter {
 public:
  explicit TablePrinter(OutputSettings settings) : settings_(std::move(settings)) {}

  void print(const protocol::QueryReply& chunk, std::string& out) override;
  void end(std::string& out) override;

 private:
  struct Value {
    std::string text;
    bool is_number;
  };
  struct Column {
    std::string heading;
    double per_unit = 1.0;
    std::size_t width = 0;
    std::size_t before_point = 0;  // of numbers
    std::size_t after_point = 0;   // characters from the decimal point on
    bool has_numbers = false;
  };
  using Line = std::vector<Value>;

  void begin(const protocol::QueryReply& chunk);
  bool has_all_columns() const { return shown_ == columns_.size(); }
  void widen(const Line& line);
  void fit();
  std::size_t line_width() const;
  bool wraps(const Column& column) const;
  std::size_t least_width(const Column& column) const;
  void print_first_rows(std::string& out);
  void print_line(const Line& line, std::string& out) const;
  void print_cells(const std::vector<std::string>& cells, std::string& out,
                   const std::string& end = {}) const;

  OutputSettings settings_;
  std::vector<Column> columns_;
  std::size_t shown_ = 0;    // number of columns shown, from the left
  std::vector<Line> first_;  // first rows, kept until the widths are known
  bool has_begun_ = false;
  bool has_head_ = false;
};

void TablePrinter::begin(const protocol::QueryReply& chunk) {
  for (int i = 0; i < chunk.columns_size(); ++i) {
    const auto place = static_cast<std::size_t>(i);
    const ShownColumn shown =
        place < settings_.shown.size() ? settings_.shown[place] : ShownColumn{chunk.columns(i)};
    Column column{.heading = protocol::visible(shown.heading), .per_unit = shown.per_unit};
    column.width = width_of(column.heading);
    columns_.push_back(std::move(column));
  }
  shown_ = columns_.size();
}

void TablePrinter::print(const protocol::QueryReply& chunk, std::string& out) {
  if (!std::exchange(has_begun_, true)) {
    begin(chunk);
  }
  protocol::ChunkRows rows(chunk);
  while (rows.next()) {
    Line line(rows.columns());
    for (std::size_t i = 0; i < line.size(); ++i) {
      const Cell& cell = rows.cell(i);
      line[i] = {table_cell(cell, columns_[i].per_unit),
                 cell.kind == CellKind::kInteger || cell.kind == CellKind::kReal};
    }
    if (has_head_) {
      print_line(line, out);
      continue;
    }
    widen(line);
    first_.push_back(std::move(line));
    if (first_.size() >= settings_.first_rows) {
      print_first_rows(out);
    }
  }
}

void TablePrinter::widen(const Line& line) {
  for (std::size_t i = 0; i < line.size(); ++i) {
    Column& column = columns_[i];
    const auto& [text, is_number] = line[i];
    if (is_number) {
      const std::size_t before = before_point(text);
      column.has_numbers = true;
      column.before_point = std::max(column.before_point, before);
      column.after_point = std::max(column.after_point, text.size() - before);
      column.width = std::max(column.width, column.before_point + column.after_point);
    } else {
      column.width = std::max(column.width, width_of(text));
    }
  }
}

std::size_t TablePrinter::line_width() const {
  std::size_t all = has_all_columns() ? 0 : kGap + width_of(kMore);
  for (std::size_t i = 0; i < shown_; ++i) {
    all += columns_[i].width + (i > 0 ? kGap : 0);
  }
  return all;
}

/// Whether the table wraps the sentences of this column.
bool TablePrinter::wraps(const Column& column) const {
  return !settings_.may_leave_out && settings_.width > 0 && !column.has_numbers &&
         &column == &columns_.back();
}

std::size_t TablePrinter::least_width(const Column& column) const {
  return wraps(column)        ? kNarrowestSentence
         : column.has_numbers ? column.width
                              : std::max(kShortestText, width_of(column.heading));
}

/// Makes lines fit the width. If all columns must be shown, wraps sentences in the last column.
/// Otherwise shortens the widest texts, then omits columns from the right, but never the first.
void TablePrinter::fit() {
  while (settings_.width > 0 && line_width() > settings_.width) {
    Column* widest = nullptr;
    for (std::size_t i = 0; i < shown_; ++i) {
      Column& column = columns_[i];
      if (column.width > least_width(column) &&
          (widest == nullptr || wraps(column) || column.width > widest->width)) {
        widest = &column;
      }
    }
    if (widest != nullptr) {
      widest->width -=
          std::min(widest->width - least_width(*widest), line_width() - settings_.width);
    } else if (settings_.may_leave_out && shown_ > 1) {
      --shown_;
    } else {
      return;
    }
  }
}

void TablePrinter::print_cells(const std::vector<std::string>& cells, std::string& out,
                               const std::string& end) const {
  const std::size_t begin = out.size();
  for (std::size_t i = 0; i < shown_; ++i) {
    const Column& column = columns_[i];
    const std::size_t padding = column.width - std::min(column.width, width_of(cells[i]));
    out.append(i > 0 ? kGap : 0, ' ');
    out.append(column.has_numbers ? padding : 0, ' ');
    out += cells[i];
    out.append(column.has_numbers ? 0 : padding, ' ');
  }
  out += end;
  while (out.size() > begin && out.back() == ' ') {
    out.pop_back();
  }
  out += '\n';
}

void TablePrinter::print_line(const Line& line, std::string& out) const {
  std::vector<std::string> cells;
  std::vector<std::string> sentence;  // further lines of the wrapped last cell
  for (std::size_t i = 0; i < line.size(); ++i) {
    const auto& [text, is_number] = line[i];
    const Column& column = columns_[i];
    cells.push_back(text);
    if (is_number) {
      const std::size_t after = text.size() - before_point(text);
      cells.back().append(column.after_point - std::min(column.after_point, after), ' ');
    } else if (wraps(column)) {
      sentence = wrapped(text, column.width);
      cells.back() = sentence.front();
    } else if (settings_.width > 0) {
      cells.back() = shortened_to(text, column.width);
    }
  }
  print_cells(cells, out);
  for (std::size_t i = 1; i < sentence.size(); ++i) {
    cells.assign(line.size(), "");
    cells.back() = sentence[i];
    print_cells(cells, out);
  }
}

void TablePrinter::print_first_rows(std::string& out) {
  fit();
  std::vector<std::string> headings;
  std::vector<std::string> rule;
  for (const Column& column : columns_) {
    headings.push_back(column.heading);
    rule.emplace_back(column.width, '-');
  }
  print_cells(headings, out, has_all_columns() ? "" : std::string(kGap, ' ') + kMore);
  print_cells(rule, out);
  has_head_ = true;
  for (const Line& line : std::exchange(first_, {})) {
    print_line(line, out);
  }
}

void TablePrinter::end(std::string& out) {
  if (!has_begun_) {
    return;
  }
  if (!has_head_) {
    print_first_rows(out);
  }
  std::vector<std::string> left_out;
  bool has_mode = false;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    const std::string& heading = columns_[i].heading;
    if (i >= shown_) {
      left_out.push_back(heading);
    } else {
      has_mode = has_mode || heading == "mode" || heading == "major_mode";
    }
  }
  if (has_mode) {
    out += fmt::format("({})\n", kModeLetters);
  }
  if (!left_out.empty()) {
    const auto lines = wrapped(fmt::format("Left out to fit {} columns ({}): {}", settings_.width,
                                           settings_.way_to_all, fmt::join(left_out, ", ")),
                               settings_.width);
    out += fmt::format("{}\n", fmt::join(lines, "\n"));
  }
}

}  // namespace

void append_number(std::string& out, double value) {
  std::array<char, solver::kLongestExactNumber> text;
  out.append(text.data(), solver::write_exact_number(value, text.data()));
}

void append_number(std::string& out, std::int64_t value) {
  std::array<char, 24> text;
  out.append(text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr);
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
  return std::make_unique<TablePrinter>(settings);
}

}  // namespace oblique::client
