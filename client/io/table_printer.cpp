// Tables for people.
#include <algorithm>
#include <cstddef>
#include <memory>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/io/row_output.h"
#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using protocol::Cell;
using protocol::CellKind;

constexpr std::size_t kGap = 2;     // between columns
constexpr const char* kMore = "…";  // ends a heading that lacks columns
/// Texts are not shortened below that.
constexpr std::size_t kShortestText = 12;
/// Nor are sentences wrapped into less.
constexpr std::size_t kNarrowestSentence = 16;

/// A value on one line: six digits, NULL as a dash.
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

/// Characters before the point of a number, all when it has none.
std::size_t before_point(std::string_view number) {
  return std::min(number.find('.'), number.size());
}

/// The first `width` characters, the last one being an ellipsis when there are more.
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

/// The words of a text in lines of at most `width` characters, where they are not longer.
std::vector<std::string> wrapped(const std::string& text, std::size_t width) {
  std::vector<std::string> lines(1);
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    std::string& line = lines.back();
    if (!line.empty() && width_of(line) + 1 + width_of(word) > width) {
      lines.push_back(word);
    } else {
      line += (line.empty() ? "" : " ") + word;
    }
  }
  return lines;
}

/// Widths of columns are those of the first rows; a later value that is wider shifts the rest of
/// its line. Where lines would be too long, texts are shortened, then columns left out from the
/// right, which a line below the table says. Another one says what the letters of a mode mean.
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
    std::size_t after_point = 0;   // the point included
    bool has_numbers = false;
    bool is_left_out = false;
  };
  using Line = std::vector<Value>;

  void begin(const protocol::QueryReply& chunk);
  void widen(const Line& line);
  void fit();
  std::size_t line_width() const;
  bool has_all_columns() const;
  bool wraps(const Column& column) const;
  void print_first_rows(std::string& out);
  void print_line(const Line& line, std::string& out) const;
  void print_cells(const std::vector<std::string>& cells, std::string& out,
                   const std::string& end = {}) const;

  OutputSettings settings_;
  std::vector<Column> columns_;
  std::vector<Line> first_;  // kept until the widths are known
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

bool TablePrinter::has_all_columns() const {
  return std::none_of(columns_.begin(), columns_.end(),
                      [](const Column& column) { return column.is_left_out; });
}

std::size_t TablePrinter::line_width() const {
  std::size_t all = has_all_columns() ? 0 : kGap + width_of(kMore);
  for (const Column& column : columns_) {
    all += column.is_left_out ? 0 : column.width + kGap;
  }
  return all - std::min(all, kGap);
}

bool TablePrinter::wraps(const Column& column) const {
  return !settings_.may_leave_out && settings_.width > 0 && !column.has_numbers &&
         &column == &columns_.back();
}

/// Makes lines fit: sentences in the last column are wrapped where all columns are kept, then the
/// widest text is shortened, and at least one column stays.
void TablePrinter::fit() {
  while (settings_.width > 0 && line_width() > settings_.width) {
    if (Column& end = columns_.back(); wraps(end) && end.width > kNarrowestSentence) {
      end.width -= std::min(end.width - kNarrowestSentence, line_width() - settings_.width);
      continue;
    }
    Column* widest = nullptr;
    for (Column& column : columns_) {
      const std::size_t least = std::max(kShortestText, width_of(column.heading));
      if (!column.has_numbers && !column.is_left_out && !wraps(column) && column.width > least &&
          (widest == nullptr || column.width > widest->width)) {
        widest = &column;
      }
    }
    if (widest != nullptr) {
      const std::size_t least = std::max(kShortestText, width_of(widest->heading));
      widest->width -= std::min(widest->width - least, line_width() - settings_.width);
      continue;
    }
    const auto last = std::find_if(columns_.rbegin(), columns_.rend(),
                                   [](const Column& column) { return !column.is_left_out; });
    if (!settings_.may_leave_out || last + 1 == columns_.rend()) {
      return;
    }
    last->is_left_out = true;
  }
}

void TablePrinter::print_cells(const std::vector<std::string>& cells, std::string& out,
                               const std::string& end) const {
  const std::size_t begin = out.size();
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Column& column = columns_[i];
    if (column.is_left_out) {
      continue;
    }
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
  std::vector<std::string> more;  // lines of the last one
  for (std::size_t i = 0; i < line.size(); ++i) {
    const auto& [text, is_number] = line[i];
    const Column& column = columns_[i];
    if (is_number) {
      const std::size_t after = text.size() - before_point(text);
      cells.push_back(text +
                      std::string(column.after_point - std::min(column.after_point, after), ' '));
    } else if (wraps(column)) {
      more = wrapped(text, column.width);
      cells.push_back(more.front());
    } else {
      cells.push_back(settings_.width > 0 && !column.is_left_out ? shortened_to(text, column.width)
                                                                 : text);
    }
  }
  print_cells(cells, out);
  for (std::size_t i = 1; i < more.size(); ++i) {
    std::vector<std::string> rest(cells.size());
    rest.back() = more[i];
    print_cells(rest, out);
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
  for (const Column& column : columns_) {
    if (column.is_left_out) {
      left_out.push_back(column.heading);
    } else {
      has_mode = has_mode || column.heading == "mode" || column.heading == "major_mode";
    }
  }
  if (has_mode) {
    out += fmt::format("({})\n", kModeLetters);
  }
  if (!left_out.empty()) {
    const auto lines = wrapped(fmt::format("Left out, for a width of {} ({}): {}", settings_.width,
                                           settings_.way_to_all, fmt::join(left_out, ", ")),
                               settings_.width);
    out += fmt::format("{}\n", fmt::join(lines, "\n"));
  }
}

}  // namespace

std::unique_ptr<RowPrinter> make_table_printer(const OutputSettings& settings) {
  return std::make_unique<TablePrinter>(settings);
}

std::size_t width_of(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char byte) {
    return (static_cast<unsigned char>(byte) & 0xc0U) != 0x80U;  // the first of a character
  }));
}

}  // namespace oblique::client
